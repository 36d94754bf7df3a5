// SPDX-License-Identifier: Apache-2.0
// Internal: the centre of a spot too small to have a rim, or of anything that looks the same turned
// by half a turn. A Gaussian of the spot's own second moments serves as the model; the centre
// solves the weighted least squares of its shift, which is unbiased for any such spot whatever the
// model's faults, and at the Cramer-Rao bound for a Gaussian one.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

struct Spot {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d second_moments_px2 =
      Eigen::Matrix2d::Zero();  ///< of the light, pixel box included
  /// Shift of the centre for a relative gradient of brightness over the light as it is seen; what
  /// is blurred has less by the blur's variance.
  Eigen::Matrix2d gradient_response_px2 = Eigen::Matrix2d::Zero();
};

/// Starts at a centre good to about a pixel and a guess of the second moments, which are known to
/// be at least `min_variance_px2` in every direction: noise must not make a faint spot sharper,
/// and surer, than the lens does. Nothing when the light there does not look like a spot.
std::optional<Spot> measure_spot(const Patch& patch, const Eigen::Vector2d& centre_px,
                                 const Eigen::Matrix2d& second_moments_px2,
                                 double min_variance_px2);

}  // namespace occ::internal::detect
