// SPDX-License-Identifier: Apache-2.0
// Internal: the ellipse that fits rim points best along its normals, each with its own sigma.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"

namespace occ::internal::detect {

/// (p - centre)^T shape (p - centre) = 1.
struct FittedConic {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();

  Ellipse ellipse() const;

  /// Half the gradient of the quadratic form: along the outward normal.
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
  double rms_px = 0;  ///< of the residuals, unweighted
};

/// Weighted least squares of normal distances; the points' own normals are not used. Nothing when
/// there are fewer than six points or they do not determine an ellipse.
std::optional<EllipseFit> fit_ellipse(const std::vector<RimPoint>& rim);

/// The same from a start close to the answer.
std::optional<EllipseFit> fit_ellipse(const std::vector<RimPoint>& rim, const FittedConic& start);

/// How the fitted centre moves (columns) when each point moves along its normal by the x or the y
/// of its entry in `moves`.
Eigen::Matrix2d centre_response(const std::vector<RimPoint>& rim, const FittedConic& conic,
                                const std::vector<Eigen::Vector2d>& moves);

}  // namespace occ::internal::detect
