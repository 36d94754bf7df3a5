// SPDX-License-Identifier: Apache-2.0
// Exact area of a disc inside a pixel in closed form: the oracle for images without blur.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace occ::test {

/// Area of the disc x^2 + y^2 < r^2 with x < a and y < b, in closed form.
inline double quadrant_area(double a, double b, double r) {
  // Integral over y < b of the chord's part left of a: the integrand is min(a, w) + w, w =
  // sqrt(r^2 - y^2), where that is positive.
  const auto half = [r](double y) {  // integral of w from 0 to y
    y = std::clamp(y, -r, r);
    return 0.5 * (y * std::sqrt(r * r - y * y) + r * r * std::asin(y / r));
  };
  const double top = std::clamp(b, -r, r);
  if (a >= r) return 2 * (half(top) - half(-r));
  if (a <= -r) return 0;
  const double h = std::sqrt(r * r - a * a);  // |y| < h: the line x = a cuts the disc
  const double in = std::clamp(top, -h, h);
  const double cut = a * (in + h) + half(in) - half(-h);
  if (a < 0) return cut;
  return cut + 2 * (half(std::min(top, -h)) - half(-r)) + 2 * (half(std::max(top, h)) - half(h));
}

/// Area of a disc inside a pixel.
inline double disc_in_pixel(const Eigen::Vector2d& pixel, const Eigen::Vector2d& centre, double r) {
  const Eigen::Vector2d low = pixel - centre - Eigen::Vector2d::Constant(0.5);
  const Eigen::Vector2d high = low + Eigen::Vector2d::Ones();
  return quadrant_area(high.x(), high.y(), r) - quadrant_area(low.x(), high.y(), r) -
         quadrant_area(high.x(), low.y(), r) + quadrant_area(low.x(), low.y(), r);
}

}  // namespace occ::test
