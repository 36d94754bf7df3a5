// SPDX-License-Identifier: Apache-2.0
// Robust least squares fit of the fluxes of lamps with a common scale of their powers. With
// s = ln(power / scene's power), a flux F of lamp l yields the equation
//
//     observed = ln F - ln G = s + ln(m_l + 1) + m_l ln cos(phi)
//
// where G is the flux of the scene's power without the factor (m + 1) cos^m(phi). A group is either
// one lamp with its own scale, or all lamps with a common factor.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/require.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::photometry {

struct FluxEquation {
  int lamp = 0;  ///< index within the group
  double log_cos = 0, observed = 0, sigma = 1;
};

struct LightFit {
  double scale = 0;              ///< s
  Eigen::VectorXd orders;        ///< fitted, or the start value
  std::vector<bool> determined;  ///< which orders were fitted
  Eigen::MatrixXd covariance;    ///< (s, orders), infinite for orders that were not fitted;
                                 ///< includes variance_factor
  double chi2 = 0;               ///< with Huber's weights
  int dof = 0;
  double variance_factor = 1;

  double residual(const FluxEquation& equation) const;
};

struct FitLimits {
  double huber_sigma, max_order_sigma;
};

/// Levenberg-Marquardt steps with Huber's loss. An order that the equations do not determine to
/// max_order_sigma, that has fewer than three of them, or that is held, keeps its start value.
/// `equations` must not be empty.
LightFit fit_light(const std::vector<FluxEquation>& equations, const Eigen::VectorXd& orders,
                   const std::vector<bool>& held_orders, const FitLimits& limits);

/// Input check of calibrate_light() and calibrate_ambient(): throws std::invalid_argument unless
/// there is a rigid pose for each image.
inline void validate_poses(std::size_t images, const std::vector<Rigid3>& cam_from_world) {
  require(images == cam_from_world.size(), "cam_from_world", cam_from_world.size(),
          "one pose for each of " + std::to_string(images) + " images");
  for (std::size_t i = 0; i < cam_from_world.size(); ++i)
    Rigid3::from_matrix(cam_from_world[i].matrix(),
                        ("cam_from_world[" + std::to_string(i) + "]").c_str());
}

}  // namespace occ::internal::photometry
