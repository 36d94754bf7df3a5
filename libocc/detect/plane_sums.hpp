// SPDX-License-Identifier: Apache-2.0
// Internal: least-squares plane through background pixels.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace occ::detecting {

/// value = at + x * right + y * down, with what the fit says of it.
struct Plane {
  double at = 0, right = 0, down = 0;
  double variance = 0;     ///< of the values about it
  double at_variance = 0;  ///< of `at`

  double operator()(double x, double y) const { return at + right * x + down * y; }
};

/// Sums over those pixels whose height above a first plane lies between two bounds. Heights are
/// small numbers, for which floats do; each column has its own sums, so that none waits for
/// another.
class PlaneSums {
 public:
  /// `first_x`: of a row's first pixel, as the planes count it.
  PlaneSums(int width, const Plane& plane, double first_x, double low, double high);

  /// Rows of pixels, `stride` floats apart; the first is at y, the others at y + step, ... Of each
  /// those pixels may count whose `counts` is 1; it is 0 for the others.
  void add_rows(const float* pixels, std::ptrdiff_t stride, int rows, double y, double step,
                const std::vector<float>& counts);

  /// The plane moved to where these pixels lie; nothing when they are too few.
  std::optional<Plane> fit() const;

 private:
  Plane plane_;
  double first_x_, low_, high_;
  int width_;
  std::vector<float> sums_;  ///< of n, y, yy, v, yv, vv: a row of columns for each
};

}  // namespace occ::detecting
