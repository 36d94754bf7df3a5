// SPDX-License-Identifier: Apache-2.0
// Robust losses rho(t) of a residual of length t, given by its square. They replace t^2 / 2, which
// they equal near zero. The weight of iteratively reweighted least squares is rho'(t) / t.
//
//     Huber   t^2 / 2 for t <= c, else c t - c^2 / 2   Ann. Math. Statist. 35, 1964, p. 73
//     Tukey   c^2 / 6 (1 - (1 - t^2 / c^2)^3) for t <= c, else c^2 / 6
//             (biweight; Beaton, Tukey, Technometrics 16, 1974, p. 147)
//
// An infinite corner c gives least squares.
#pragma once

#include <algorithm>
#include <cmath>

namespace occ::internal::core {

inline double huber_loss(double squared, double corner) {
  if (squared <= corner * corner) return 0.5 * squared;
  return corner * std::sqrt(squared) - 0.5 * corner * corner;
}

inline double huber_weight(double squared, double corner) {
  return squared <= corner * corner ? 1 : corner / std::sqrt(squared);
}

inline double tukey_loss(double squared, double corner) {
  if (std::isinf(corner)) return 0.5 * squared;
  const double inside = std::max(0.0, 1 - squared / (corner * corner));
  return corner * corner / 6 * (1 - inside * inside * inside);
}

inline double tukey_weight(double squared, double corner) {
  if (std::isinf(corner)) return 1;
  const double inside = std::max(0.0, 1 - squared / (corner * corner));
  return inside * inside;
}

}  // namespace occ::internal::core
