// SPDX-License-Identifier: Apache-2.0
// Covariance of a fitted pose where the projection is not linear within its errors.
//
// The fit determines s = J (r(x) - r(0)) up to noise of unit variance, with its Jacobian and
// residuals whitened. Few points in a plane or near a line leave a rotation so uncertain that the
// poses x(s) lie on a curve. The inverse of the information describes its tangent only (Bates,
// Watts, "Relative curvature measures of nonlinearity", J. R. Stat. Soc. B 42, 1980).
//
// Two steps widen the covariance. The second-order term of x(s) adds its second moment for normal
// s,  M = b b^T + 2 sum_ij b_ij b_ij^T  with  b = sum_i b_ii. A Gaussian of that moment still has
// shorter tails than the curve. Therefore, the covariance is enlarged until poses at 4 sigma along
// the curve are inside 6 of its sigmas.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/point_fit.hpp"

namespace occ::internal::locate {

/// True if the curve leaves its tangent, at 4 sigma, by an amount that the errors do not hide. The
/// test is an upper bound and takes no evaluation of residuals. `rotation_variance`: trace [rad^2].
LIBOCC_API bool is_curved(const pose::PointFit& fit, double rotation_variance);

/// True if chi2 at 4 sigma along the curve is far below its quadratic model: the likelihood is
/// flat, and no covariance describes the pose.
LIBOCC_API bool is_flat(const pose::SeenPoints& seen, const pose::PointFit& fit,
                        double variance_factor);

/// Covariance of the fit's pose as a left perturbation (rotation, then translation), in the unit of
/// the points' frame. `variance_factor` multiplies the variance of the residuals. Includes the
/// second-order effect of a rotation about distant points (arc_moment).
LIBOCC_API Matrix6 left_covariance(const pose::SeenPoints& seen, const pose::PointFit& fit,
                                   double variance_factor);

}  // namespace occ::internal::locate
