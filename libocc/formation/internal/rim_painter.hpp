// SPDX-License-Identifier: Apache-2.0
// Inner loops of formation/coverage.cpp. Points of a rim are painted as steps along the rows that
// they reach; running sums of the steps along each row give the coverage. The time for a point
// therefore does not depend on the number of pixels to its right.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/pixel_psf.hpp"

namespace occ::internal::formation {

/// A point of a rim, in pixels of the canvas, with its weight dy in the contour integral.
struct PaintedRimPoint {
  double x, y, dy;
};

/// Steps of the coverage and, beside it for each row, of its first moments. Memory is reused. In
/// single precision the error of the coverage is 3e-7, and moments are not available.
template <typename Real>
class Canvas {
 public:
  explicit Canvas(Simd simd) : simd_(simd) {}

  /// Number of zeros around the canvas on all sides.
  static constexpr int margin = 4;

  /// Sets the size, and removes all points and values. Without moments it only holds coverage.
  void prepare(int width, int height, bool with_moments);

  void add(const PaintedRimPoint& point) { rim_.push_back(point); }

  /// Paints the steps of all points that were added.
  void paint(const PixelPsf& psf);

  /// Replaces the steps by their running sums along the rows.
  void sum();

  // Coverage and its moments at the first pixel, after sum(). Rows are row_stride() values apart.

  const Real* c() const { return pixels_.data() + begin_; }
  const Real* m_x() const { return c() + stride_; }
  const Real* m_y() const { return m_x() + stride_; }
  std::ptrdiff_t row_stride() const { return with_moments_ ? 3 * stride_ : stride_; }

 private:
  Simd simd_;
  int width_ = 0, height_ = 0;
  bool with_moments_ = false;
  std::ptrdiff_t stride_ = 0;  // distance between the coverage and the moments of a row
  std::ptrdiff_t begin_ = 0;   // index of the first pixel, aligned
  std::vector<Real> pixels_;   // c, m_x, m_y of each row
  std::vector<PaintedRimPoint> rim_;
  std::vector<Real> buffer_;
};

}  // namespace occ::internal::formation
