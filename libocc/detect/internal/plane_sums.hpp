// SPDX-License-Identifier: Apache-2.0
// Internal: least-squares plane through background pixels.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace occ::internal::detect {

/// value = at + x * right + y * down, with what the fit says of it.
struct Plane {
  double at = 0, right = 0, down = 0;
  double variance = 0;     ///< of the values about it
  double at_variance = 0;  ///< of `at`

  double operator()(double x, double y) const { return at + right * x + down * y; }
};

/// Sums over those pixels whose height above a first plane lies between two bounds. Heights are
/// small numbers, for which floats do; every eighth column shares its sums.
class PlaneSums {
 public:
  static constexpr std::size_t lanes = 8;

  /// Heights from `low` to `high` above the plane count.
  PlaneSums(const Plane& plane, double low, double high) : plane_(plane), low_(low), high_(high) {}

  /// Rows of pixels, `stride` floats apart, the first pixel at (x, y), the next row at y + step.
  /// `counts` is 1 for the columns that may count, else 0, and as many as there are columns,
  /// rounded up to whole lanes; that many pixels of each row must be readable.
  void add_rows(const float* pixels, std::ptrdiff_t stride, int rows, double x, double y,
                double step, const std::vector<float>& counts);

  /// The plane moved to where these pixels lie; nothing when they are too few.
  std::optional<Plane> fit() const;

 private:
  enum Sum { n, x, y, xx, xy, yy, v, xv, yv, vv, count };

  double total(Sum which) const;

  Plane plane_;
  double low_, high_;
  alignas(32) std::array<std::array<float, lanes>, count> sums_ = {};
};

}  // namespace occ::internal::detect
