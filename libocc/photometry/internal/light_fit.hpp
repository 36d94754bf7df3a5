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
#include <vector>

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

/// Levenberg-Marquardt steps with Huber's loss. An order that the equations do not determine to
/// max_order_sigma, or that has fewer than three of them, keeps its start value. `equations` must
/// not be empty.
LightFit fit_light(const std::vector<FluxEquation>& equations, const Eigen::VectorXd& orders,
                   const FitLimits& limits);

}  // namespace occ::internal::photometry
