// SPDX-License-Identifier: Apache-2.0
// One image observation, linear in the unknowns: r + A (its image's unknowns) + B (its target's),
// over its sigmas. And what robust estimation makes of its length.
#pragma once

#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

/// rho(|r|) = s^2 f(|r| / s), f(t) = t^2 / 2 near 0. Huber: linear beyond 2, Tukey: constant
/// beyond 6 (both for the length of two residuals, of which 86 % are within 2, all but 1e-8 within
/// 6).
struct Loss {
  enum class Kind { squared, huber, tukey };
  Kind kind = Kind::squared;
  double scale = 1;

  double rho(double squared) const {
    const double t2 = squared / (scale * scale);
    double f = 0.5 * t2;
    if (kind == Kind::huber) f = core::huber_loss(t2, huber);
    if (kind == Kind::tukey) f = core::tukey_loss(t2, tukey);
    return scale * scale * f;
  }
  double weight(double squared) const {
    const double t2 = squared / (scale * scale);
    if (kind == Kind::huber) return core::huber_weight(t2, huber);
    if (kind == Kind::tukey) return core::tukey_weight(t2, tukey);
    return 1;
  }

  static constexpr double huber = 2, tukey = 6;
};

/// Counted for an observation whose target its camera cannot show [sigmas].
constexpr double lost_residual = 1e4;

struct ObservationRows {
  double a[2][max_columns];
  double b[2][max_group];
  double r[2];
  int width = 0, size = 0;  ///< columns of a and of b
};

/// Projected minus seen, over sigma; false where the camera shows nothing.
bool residual_of(const Network& network, const NetworkState& state, const ImageObservation& seen,
                 double r[2]);

/// False where the camera shows nothing. Columns of b: those of target_jacobian.
bool rows_of(const Network& network, const NetworkLayout& layout, const NetworkState& state,
             const ImageObservation& seen, ObservationRows& rows);

}  // namespace occ::internal::network
