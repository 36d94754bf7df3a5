// SPDX-License-Identifier: Apache-2.0
// Cofactors of the residuals: which part of an observation's error appears in its own residual
// (redundancy number 1 - J Q J^T, network_statistics.hpp), and which part the fit absorbs (J Q
// J^T).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

struct ResidualCofactor {
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();      ///< (projected - observed) / sigma
  Eigen::Matrix2d absorbed = Eigen::Matrix2d::Identity();  ///< J Q J^T, over sigmas
  bool used = false;

  /// Redundancy matrix, equal to the covariance of `residual`.
  Eigen::Matrix2d redundancy() const { return Eigen::Matrix2d::Identity() - absorbed; }
};

/// One for each image observation. `covariance`: of the reduced unknowns, in any datum.
std::vector<ResidualCofactor> residual_cofactors(const Network& network,
                                                 const NetworkLayout& layout,
                                                 const NetworkState& state,
                                                 const NormalEquations& normal,
                                                 const Eigen::MatrixXd& covariance, int threads);

struct DistanceCofactor {
  double residual = 0;    ///< (adjusted - observed) / sigma
  double redundancy = 0;  ///< redundancy number
  bool used = false;
};

DistanceCofactor distance_cofactor(const Network& network, const NetworkLayout& layout,
                                   const NetworkState& state,
                                   const DistanceObservation& observation,
                                   const Eigen::MatrixXd& covariance);

/// Covariance of a determined target's position [m^2], for `covariance` of the reduced unknowns.
/// For targets of control points it is the same in any datum.
Eigen::Matrix3d position_cofactor(const Network& network, const NetworkLayout& layout,
                                  const NetworkState& state, const NormalEquations& normal,
                                  const Eigen::MatrixXd& covariance, const Target& target);

}  // namespace occ::internal::network
