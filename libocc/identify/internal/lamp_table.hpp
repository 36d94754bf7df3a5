// SPDX-License-Identifier: Apache-2.0
// Internal: lamps of one height, their near triangles by shape and all of them by place. Seen along
// the vertical a horizontal pattern is similar to itself on the map, so that two numbers that no
// turn, shift or height changes say which triangles three blobs may be.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::identify {

using Complex = std::complex<double>;

/// (c - a) / (b - a).
inline Complex shape_of(const Complex& a, const Complex& b, const Complex& c) {
  return (c - a) / (b - a);
}

class LampTable {
 public:
  /// The first two corners are the longest side's, the third is nearer to the first.
  struct Triangle {
    float re = 0, im = 0;  ///< its shape: re in [0, 1/2], |im| < 1
    std::array<int, 3> lamps{};
  };

  explicit LampTable(const std::vector<Lamp>& lamps);

  /// Whether most lamps hang at one height, so that the table can name them.
  bool applies() const { return applies_; }
  bool is_of(const std::vector<Lamp>& lamps) const;  ///< the same, at the same places
  double height_m() const { return height_m_; }
  double thickness_m() const { return thickness_m_; }  ///< root mean square, about that height
  double lamps_per_m2() const { return lamps_per_m2_; }
  std::size_t count() const { return members_.size(); }
  const Complex& place(int lamp) const { return places_[lamp]; }
  const std::vector<Triangle>& triangles() const { return triangles_; }

  /// Calls visit(triangle) for all whose shape is that near.
  template <class Visit>
  void visit_alike(const Complex& shape, double tolerance, const Visit& visit) const;

  /// The lamp of that height nearest to a place, -1 when there is none within the distance.
  int lamp_near(const Complex& place, double distance_m) const;

  static constexpr int neighbours = 16;  ///< of a lamp, that are in triangles with it

 private:
  static constexpr int cells_re = 50, cells_im = 200;
  static int shape_cell_re(double re);
  static int shape_cell_im(double im);
  std::size_t find_height();
  void keep_one_of_each_place();
  void lay_out();
  std::vector<int> nearest(int lamp) const;
  void add_triangles();
  std::array<int, 2> cell_of(const Complex& place) const;
  template <class Visit>
  void visit_cell(int x, int y, const Visit& visit) const;

  bool applies_ = false;
  double height_m_ = 0, thickness_m_ = 0, lamps_per_m2_ = 0;
  std::vector<Complex> places_;    // of all lamps
  std::vector<double> heights_m_;  // likewise
  std::vector<int> members_;       // those of the height, by cell of the plan
  Complex corner_;                 // of the plan
  double cell_m_ = 1;
  std::array<int, 2> cells_{1, 1};
  std::vector<int> cell_ends_;
  std::vector<Triangle> triangles_;  // by cell of the shape
  std::vector<int> shape_ends_;
};

template <class Visit>
void LampTable::visit_alike(const Complex& shape, double tolerance, const Visit& visit) const {
  const int re0 = shape_cell_re(shape.real() - tolerance),
            re1 = shape_cell_re(shape.real() + tolerance),
            im0 = shape_cell_im(shape.imag() - tolerance),
            im1 = shape_cell_im(shape.imag() + tolerance);
  for (int re = re0; re <= re1; ++re) {
    const auto end = static_cast<std::size_t>(shape_ends_[re * cells_im + im1]);
    const int before = re * cells_im + im0 - 1;
    std::size_t i = before < 0 ? 0 : static_cast<std::size_t>(shape_ends_[before]);
    for (; i < end; ++i) {
      const Triangle& t = triangles_[i];
      const double off_re = t.re - shape.real(), off_im = t.im - shape.imag();
      if (off_re * off_re + off_im * off_im <= tolerance * tolerance) visit(t);
    }
  }
}

}  // namespace occ::internal::identify
