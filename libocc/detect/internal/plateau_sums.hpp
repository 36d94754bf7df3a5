// SPDX-License-Identifier: Apache-2.0
// Internal: sums over the pixels inside a disc, from which a polynomial surface of its light
// follows.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/normal_table.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// Part of the light that the blur of the rim leaves to a pixel inside.
class Cover {
 public:
  Cover(const FittedConic& conic, double blur_px)
      : xx_(conic.shape(0, 0)),
        xy_(conic.shape(0, 1)),
        yy_(conic.shape(1, 1)),
        determinant_(conic.shape.determinant()),
        blur_(blur_px) {}

  /// (dx, dy): from the ellipse's centre. The distance is that of the rim on the ray through the
  /// pixel, along the normal there; blur moves the edge of a convex shape inwards by half its
  /// curvature times the blur squared.
  double operator()(double dx, double dy) const {
    const double out_x = xx_ * dx + xy_ * dy, out_y = xy_ * dx + yy_ * dy;
    const double form = out_x * dx + out_y * dy;
    const double length2 = out_x * out_x + out_y * out_y;
    // Cheap and sure: (1 - form) / 2 |out| is more than the distance by less than half of it.
    if ((1 - form) * (1 - form) > 144 * blur_ * blur_ * length2) return 1;
    const double radius = std::sqrt(form), length = std::sqrt(length2);
    const double distance = radius * (1 - radius) / length;
    const double curvature = determinant_ * form * radius / (length2 * length);
    return table_(distance / blur_ - 0.5 * curvature * blur_).below;
  }

 private:
  double xx_, xy_, yy_, determinant_, blur_;
  const NormalTable& table_ = NormalTable::get();
};

/// Sums over pixels of u^i v^j, and of these times the signal, of a surface of this degree seen
/// through `cover`.
template <int Degree>
struct Sums {
  static constexpr int powers = 2 * Degree + 1;
  double power[powers][powers] = {};
  double signal[Degree + 1][Degree + 1] = {};
  double squares = 0;
  int pixels = 0;

  /// A row of pixels from (dx, dy) on; v is common to it, only powers of u are summed.
  void add_row(const float* row, double dx, double dy, int count, double scale,
               const Cover& cover) {
    double u[powers] = {}, s[Degree + 1] = {};
    for (int i = 0; i < count; ++i, dx += 1) {
      const double part = cover(dx, dy), at = dx * scale, value = row[i];
      double area = part * part, seen = part * value;
      for (int k = 0; k < powers; ++k, area *= at) u[k] += area;
      for (int k = 0; k <= Degree; ++k, seen *= at) s[k] += seen;
      squares += value * value;
    }
    pixels += count;
    double factor = 1;
    for (int j = 0; j < powers; ++j, factor *= dy * scale) {
      for (int i = 0; i + j < powers; ++i) power[i][j] += factor * u[i];
      for (int i = 0; i + j <= Degree; ++i) signal[i][j] += factor * s[i];
    }
  }
};

/// Calls f(y, x0, x1) for the rows of pixels inside the ellipse shrunk by a factor but not inside
/// the one shrunk by `hollow`.
template <typename F>
void for_each_row(const Patch& patch, const FittedConic& conic, double shrink, double hollow,
                  F&& f) {
  const double xx = conic.shape(0, 0), xy = conic.shape(0, 1);
  const double determinant = conic.shape.determinant();
  const double half_height = shrink * std::sqrt(xx / determinant);
  const auto first = [](double v, int low) {
    return std::max(low, static_cast<int>(std::ceil(v)));
  };
  const auto last = [](double v, int high) {
    return std::min(high, static_cast<int>(std::floor(v)));
  };
  const double cx = conic.centre.x(), cy = conic.centre.y();
  const int right = patch.x0() + patch.width() - 1;
  const int y1 = last(cy + half_height, patch.y0() + patch.height() - 1);
  for (int y = first(cy - half_height, patch.y0()); y <= y1; ++y) {
    const double dy = y - cy;
    const double middle = cx - xy * dy / xx;
    const auto half_width = [&](double size) {
      return std::sqrt(std::max(0.0, size * size * xx - determinant * dy * dy)) / xx;
    };
    const double root = half_width(shrink), inner = half_width(hollow);
    const int x0 = first(middle - root, patch.x0()), x1 = last(middle + root, right);
    if (inner > 0) {
      const int left_end = last(middle - inner, right);
      const int right_start = first(middle + inner, std::max(patch.x0(), left_end + 1));
      if (left_end >= x0) f(y, x0, left_end);
      if (x1 >= right_start) f(y, right_start, x1);
    } else if (x1 >= x0) {
      f(y, x0, x1);
    }
  }
}

}  // namespace occ::internal::detect
