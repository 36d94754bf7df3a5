// SPDX-License-Identifier: Apache-2.0
// Least squares of the fluxes of lamps that share one scale of their powers. With s = ln(power over
// the scene's) a flux F of lamp l gives the equation
//
//     seen = ln F - ln G = s + ln(m_l + 1) + m_l ln cos(phi)
//
// with G the flux of the scene's power but for (m + 1) cos^m(phi). One lamp alone has a scale of
// its own; lamps together have a common factor.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/require.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::photometry {

struct FluxEquation {
  int lamp = 0;  ///< of those that share the scale
  double log_cos = 0, seen = 0, sigma = 1;
};

struct LightFit {
  double scale = 0;              ///< s
  Eigen::VectorXd orders;        ///< fitted, or as at the start
  std::vector<bool> determined;  ///< which orders were fitted
  Eigen::MatrixXd covariance;    ///< of (s, orders), infinite for orders that were not fitted;
                                 ///< contains variance_factor
  double chi2 = 0;               ///< robust
  int dof = 0;
  double variance_factor = 1;

  double residual(const FluxEquation& equation) const;
};

struct FitLimits {
  double huber_sigma, max_order_sigma;
};

/// Gauss and Newton's steps. An order that the equations do not determine to max_order_sigma, or
/// that has fewer than three of them, stays where it started. There is an equation at least.
LightFit fit_light(const std::vector<FluxEquation>& equations, const Eigen::VectorXd& orders,
                   const FitLimits& limits);

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
