// SPDX-License-Identifier: Apache-2.0
// Inner loops of formation/coverage.cpp. Each point of a rim adds a step to the rows that it
// touches, so its cost does not depend on the number of pixels to its right; the steps are then
// summed.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/pixel_psf.hpp"

namespace occ::internal::formation {

/// A point of a rim on the canvas, pixel (0, 0) being its first, with its share of the contour.
struct PaintedRimPoint {
  double x, y, dy;
};

/// Steps of coverage and of its first moments, side by side for each row; memory is reused. In
/// single precision coverage is accurate to 3e-7, and there are no moments.
template <typename Real>
class Canvas {
 public:
  explicit Canvas(Simd simd) : simd_(simd) {}

  /// Width of the border of zeros around the canvas.
  static constexpr int margin = 4;

  /// Clears the canvas to a size, without points; without moments it holds coverage only.
  void prepare(int width, int height, bool with_moments);

  void add(const PaintedRimPoint& point) { rim_.push_back(point); }

  /// Paints all points that have been added.
  void paint(const PixelPsf& psf);

  /// Sums the steps along the rows.
  void sum();

  // Once summed: coverage, or its moments, at the first pixel; the row below is row_stride() on.

  const Real* c() const { return pixels_.data() + begin_; }
  const Real* m_x() const { return c() + stride_; }
  const Real* m_y() const { return m_x() + stride_; }
  std::ptrdiff_t row_stride() const { return with_moments_ ? 3 * stride_ : stride_; }

 private:
  Simd simd_;
  int width_ = 0, height_ = 0;
  bool with_moments_ = false;
  std::ptrdiff_t stride_ = 0;  // from one of a row's sums to the next
  std::ptrdiff_t begin_ = 0;   // of the first pixel, aligned
  std::vector<Real> pixels_;   // of each row: c, m_x, m_y
  std::vector<PaintedRimPoint> rim_;
  std::vector<Real> buffer_;
};

}  // namespace occ::internal::formation
