// SPDX-License-Identifier: Apache-2.0
// Internal: maximum-likelihood ellipse through rim points, each with its own sigma along the
// normal. Minimises the sum of squared normal distances (first order) over sigma by Gauss-Newton,
// started from an algebraic fit.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/internal/dense.hpp"

namespace occ::internal::detect {

/// Ellipse (p - centre)^T shape (p - centre) = 1.
struct FittedConic {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();

  Ellipse ellipse() const;

  /// Half the gradient of the quadratic form; parallel to the outward normal.
  Eigen::Vector2d outward(const Eigen::Vector2d& point) const { return shape * (point - centre); }

  /// Distance from the ellipse along its normal, to first order; positive outside.
  double distance(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d out = outward(point);
    return 0.5 * (out.dot(point - centre) - 1) / out.norm();
  }
};

struct EllipseFit {
  FittedConic conic;
  Eigen::Matrix2d centre_covariance_px2 = Eigen::Matrix2d::Zero();
  double chi2 = 0;
  int dof = 0;        ///< points minus five
  double rms_px = 0;  ///< root mean square of the unweighted residuals
};

/// Weighted least squares of normal distances; RimPoint::normal is not used. Empty for fewer than
/// six points, or when they do not determine an ellipse. `start`: initial value.
std::optional<EllipseFit> fit_ellipse(const std::vector<RimPoint>& rim);
std::optional<EllipseFit> fit_ellipse(const std::vector<RimPoint>& rim, const FittedConic& start);

/// Derivative of the fitted centre: column k is the shift of the centre when point i moves along
/// its normal by moves[i][k].
Eigen::Matrix2d centre_response(const std::vector<RimPoint>& rim, const FittedConic& conic,
                                const std::vector<Eigen::Vector2d>& moves);

/// Maps the unit circle to the ellipse, as offsets from its centre.
inline Eigen::Matrix2d ellipse_from_circle(const FittedConic& conic) {
  const Eigen::Matrix2d root = core::Cholesky<Eigen::Matrix2d>(conic.shape).lower().transpose();
  return root.inverse();
}

}  // namespace occ::internal::detect
