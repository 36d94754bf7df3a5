// SPDX-License-Identifier: Apache-2.0
// Linearised image observation, divided by its sigmas: r + A dx_image + B dx_target, with the
// unknowns of its image and of its target.
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

/// Length of the residual [sigmas] counted for an observation whose target is not in view.
constexpr double out_of_view_residual = 1e4;

struct ObservationRows {
  double a[2][max_columns];
  double b[2][max_group];
  double r[2];
  int width = 0, size = 0;  ///< number of columns of a and of b
};

/// Residual (projected - observed) / sigma; false when the target is not in view. The displacement
/// of an outline's centre is not in it: it is small near the reference.
bool residual_of(const Network& network, const NetworkState& state,
                 const ImageObservation& observation, double r[2]);

/// Rows of the design matrix; false when the target is not in view. Columns of b as in
/// target_jacobian().
bool rows_of(const Network& network, const NetworkLayout& layout, const NetworkState& state,
             const ImageObservation& observation, ObservationRows& rows);

}  // namespace occ::internal::network
