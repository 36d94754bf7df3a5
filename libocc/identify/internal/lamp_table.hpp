// SPDX-License-Identifier: Apache-2.0
// Lookup table for lamps that hang at one height: triangles of neighbouring lamps by shape, and all
// lamps by position.
//
// In a horizontal plane, the image seen along the vertical is similar to the map. The shape of a
// triangle, (c - a) / (b - a) in complex numbers, is invariant to rotation, translation and scale.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::identify {

using Complex = std::complex<double>;

/// Shape of the triangle a, b, c: (c - a) / (b - a).
inline Complex shape_of(const Complex& a, const Complex& b, const Complex& c) {
  return (c - a) / (b - a);
}

class LampTable {
 public:
  /// The first two corners are those of the longest side; the third is nearer to the first.
  struct Triangle {
    float re = 0, im = 0;  ///< shape: re in [0, 1/2], |im| < 1
    std::array<int, 3> lamps{};
  };

  explicit LampTable(const std::vector<Lamp>& lamps);

  /// True if four fifths of the lamps, and at least four, hang at one height.
  bool applies() const { return applies_; }
  bool is_of(const std::vector<Lamp>& lamps) const;  ///< compares the positions exactly
  double height_m() const { return height_m_; }
  double thickness_m() const { return thickness_m_; }  ///< root mean square deviation from height_m
  double lamps_per_m2() const { return lamps_per_m2_; }
  std::size_t count() const { return members_.size(); }
  const Complex& position(int lamp) const { return positions_[lamp]; }
  const std::vector<Triangle>& triangles() const { return triangles_; }

  /// Calls visit(triangle) for all triangles whose shape is within the tolerance.
  template <class Visit>
  void visit_similar(const Complex& shape, double tolerance, const Visit& visit) const;

  /// Lamp nearest to a position, of those at the common height; -1 if none is within the distance.
  int lamp_near(const Complex& position, double distance_m) const;

  static constexpr int neighbours =
      16;  ///< number of nearest lamps that form triangles with a lamp

 private:
  static constexpr int cells_re = 50, cells_im = 200;
  static int shape_cell_re(double re);
  static int shape_cell_im(double im);
  std::size_t find_height();
  void remove_duplicates();
  void build_grid();
  std::vector<int> nearest(int lamp) const;
  void add_triangles();
  std::array<int, 2> cell_of(const Complex& position) const;
  template <class Visit>
  void visit_cell(int x, int y, const Visit& visit) const;

  bool applies_ = false;
  double height_m_ = 0, thickness_m_ = 0, lamps_per_m2_ = 0;
  std::vector<Complex> positions_;  // of all lamps
  std::vector<double> heights_m_;   // likewise
  std::vector<int> members_;        // lamps at the common height, sorted by grid cell
  Complex corner_;                  // of the grid
  double cell_m_ = 1;
  std::array<int, 2> cells_{1, 1};
  std::vector<int> cell_ends_;
  std::vector<Triangle> triangles_;  // sorted by shape cell
  std::vector<int> shape_ends_;
};

template <class Visit>
void LampTable::visit_similar(const Complex& shape, double tolerance, const Visit& visit) const {
  const int re0 = shape_cell_re(shape.real() - tolerance),
            re1 = shape_cell_re(shape.real() + tolerance),
            im0 = shape_cell_im(shape.imag() - tolerance),
            im1 = shape_cell_im(shape.imag() + tolerance);
  for (int re = re0; re <= re1; ++re) {
    const int end = shape_ends_[re * cells_im + im1];
    const int before = re * cells_im + im0 - 1;
    int i = before < 0 ? 0 : shape_ends_[before];
    for (; i < end; ++i) {
      const Triangle& t = triangles_[i];
      const double off_re = t.re - shape.real(), off_im = t.im - shape.imag();
      if (off_re * off_re + off_im * off_im <= tolerance * tolerance) visit(t);
    }
  }
}

}  // namespace occ::internal::identify
