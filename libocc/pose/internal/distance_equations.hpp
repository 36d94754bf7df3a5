// SPDX-License-Identifier: Apache-2.0
// Internal: the three equations of P3P in the distances d_i of the points from the camera,
//     (d_i - d_j)^2 + d_i d_j |f_i - f_j|^2 = |P_i - P_j|^2,
// in chords instead of cosines, so that nothing cancels at narrow angles. Scalar is a double, or an
// Eigen::Array of several roots at once.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

inline int next(int k) { return k == 2 ? 0 : k + 1; }

inline int largest_of(double a, double b, double c) {
  const int i = b > a;
  return c > std::max(a, b) ? 2 : i;
}

/// Entry k is of the pair (k, k+1). The squared sides sum to 1, which sets the unit of length.
struct Triangle {
  double chord2[3];  ///< |f_k - f_k+1|^2
  double side2[3];   ///< |P_k - P_k+1|^2
  double inverse_side[3];
};

/// Residual of pair k as a shift of one of its points [side lengths' unit].
template <class Scalar>
Scalar shift_at(const Triangle& t, const Scalar depth[3], int k) {
  using std::abs;
  const Scalar &from = depth[k], &to = depth[next(k)];
  const Scalar step = from - to;
  return abs(step * step + from * to * t.chord2[k] - t.side2[k]) * t.inverse_side[k];
}

/// The worst residual as an angle [rad]: about twice the error of the bearings that explains it.
inline double misfit_at(const Triangle& t, const double depth[3]) {
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    const double angle = shift_at(t, depth, k) / std::min(depth[k], depth[next(k)]);
    if (!(angle <= worst)) worst = angle;  // NaN stays
  }
  return worst;
}

/// Residuals and derivatives: of pair k with respect to depth k (p) and to depth k+1 (q).
template <class Scalar>
struct Linearised {
  Scalar residual[3], p[3], q[3];

  Linearised(const Triangle& t, const Scalar depth[3]) {
    for (int k = 0; k < 3; ++k) {
      const Scalar step = depth[k] - depth[next(k)], far = depth[next(k)] * t.chord2[k];
      residual[k] = step * step + depth[k] * far - t.side2[k];
      p[k] = 2 * step + far;
      q[k] = depth[k] * t.chord2[k] - 2 * step;
    }
  }

  /// Newton's step by Cramer's rule on the cyclic matrix with p on its diagonal and q after it.
  /// Returns |determinant| over the product of the rows' sizes: 0 at a double root.
  Scalar move(Scalar depth[3]) const {
    using std::abs;
    const Scalar ppp = p[0] * p[1] * p[2], qqq = q[0] * q[1] * q[2], determinant = ppp + qqq;
    const Scalar inverse = 1 / determinant;
    for (int k = 0; k < 3; ++k) {
      const int l = next(k), m = next(l);
      depth[k] -=
          inverse * (p[m] * (p[l] * residual[k] - q[k] * residual[l]) + q[k] * q[l] * residual[m]);
    }
    const Scalar sizes =
        (abs(p[0]) + abs(q[0])) * (abs(p[1]) + abs(q[1])) * (abs(p[2]) + abs(q[2]));
    return abs(determinant) / sizes;
  }
};

}  // namespace occ::internal::pose
