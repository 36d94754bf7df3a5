// SPDX-License-Identifier: Apache-2.0
// How much of each image observation's residual the adjustment leaves to be seen.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

struct ResidualCofactor {
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();  ///< projected - seen, over sigma
  Eigen::Matrix2d fitted =
      Eigen::Matrix2d::Identity();  ///< J Q J^T, over sigmas: what the fit takes
  bool used = false;

  /// Redundancy numbers: the residual's covariance is their matrix.
  Eigen::Matrix2d left() const { return Eigen::Matrix2d::Identity() - fitted; }
};

/// For every image observation. `covariance`: of the reduced unknowns, any datum.
std::vector<ResidualCofactor> residual_cofactors(const Network& network,
                                                 const NetworkLayout& layout,
                                                 const NetworkState& state,
                                                 const NormalEquations& normal,
                                                 const Eigen::MatrixXd& covariance, int threads);

struct DistanceCofactor {
  double residual = 0;  ///< adjusted - stated, over sigma
  double left = 0;      ///< redundancy number
  bool used = false;
};

DistanceCofactor distance_cofactor(const Network& network, const NetworkLayout& layout,
                                   const NetworkState& state, const DistanceObservation& known,
                                   const Eigen::MatrixXd& covariance);

}  // namespace occ::internal::network
