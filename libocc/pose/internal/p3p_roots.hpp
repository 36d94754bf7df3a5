// SPDX-License-Identifier: Apache-2.0
// The distances d_i of three points from the camera (P3P). They solve the three equations
//     (d_i - d_j)^2 + d_i d_j |f_i - f_j|^2 = |P_i - P_j|^2
// with bearings f and points P: chords |f_i - f_j| instead of cosines, to avoid cancellation at
// narrow angles. Initial values come from conic_pencil.hpp; Newton's method follows. `Scalar` is a
// double, or an Eigen::Array of several roots.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

inline int next(int k) { return k == 2 ? 0 : k + 1; }

/// Index of the largest of three numbers.
inline int argmax(double a, double b, double c) {
  const int i = b > a;
  return c > std::max(a, b) ? 2 : i;
}

/// Entry k belongs to the pair (k, k+1). The squared sides sum to 1, which sets the unit of length.
struct Triangle {
  double chord2[3];  ///< |f_k - f_k+1|^2
  double side2[3];   ///< |P_k - P_k+1|^2
  double inverse_side[3];
};

/// Residual of pair k as a displacement of one of its points, in the triangle's unit.
template <class Scalar>
Scalar displacement(const Triangle& t, const Scalar depth[3], int k) {
  using std::abs;
  const Scalar &from = depth[k], &to = depth[next(k)];
  const Scalar step = from - to;
  return abs(step * step + from * to * t.chord2[k] - t.side2[k]) * t.inverse_side[k];
}

/// Largest residual as an angle [rad], about twice the error of the bearings that causes it.
inline double angular_misfit(const Triangle& t, const double depth[3]) {
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    const double angle = displacement(t, depth, k) / std::min(depth[k], depth[next(k)]);
    if (!(angle <= worst)) worst = angle;  // keeps NaN
  }
  return worst;
}

/// Residuals of the equations; derivatives of equation k by depth k (p) and by depth k+1 (q).
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

  /// Newton's step by Cramer's rule; the Jacobian is cyclic, with p on the diagonal and q beside
  /// it. Returns |determinant| over the product of the rows' sizes, which is 0 at a double root.
  Scalar newton_step(Scalar depth[3]) const {
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

struct Root {
  double depth[3];
  double misfit = 0;  ///< see angular_misfit
  bool real = true;   ///< false for the real part of a complex pair
};

inline constexpr int max_roots = 8;  ///< four roots, each found at most twice

/// All real roots with positive distances, to rounding; returns their number. Two roots that
/// rounding of the distances makes indistinguishable are merged unless `keep_close`: the bearings
/// may still distinguish them.
int find_roots(const Triangle& triangle, bool keep_close, Root roots[max_roots]);

/// Real parts of the roots before any polishing; returns their number. Noise in the bearings can
/// turn a double root into a complex pair. `misfit` is not set.
int find_real_parts(const Triangle& triangle, Root roots[4]);

}  // namespace occ::internal::pose
