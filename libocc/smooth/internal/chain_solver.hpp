// SPDX-License-Identifier: Apache-2.0
// Solves a chain: maximum-likelihood poses (Levenberg-Marquardt), their covariances, and the test
// of the odometry steps for gross errors.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/smooth/internal/chain_problem.hpp"

namespace occ::internal::smooth {

template <class Body>
struct ChainSolution {
  std::vector<typename Body::Pose> poses;
  ChainCovariance<Body::size> covariance;
  double cost = 0;
  int iterations = 0;
  bool converged = false;
};

/// Minimises from `poses`. Sets the reports of the links and the marks of sightings aside.
template <class Body>
ChainSolution<Body> solved(Chain<Body>& chain, std::vector<typename Body::Pose> poses,
                           const SmootherOptions& options);

/// Result for the user: status, message, poses with covariances, statistics.
template <class Body>
Result<Smoothing<typename Body::Smoothed>> to_result(const Chain<Body>& chain,
                                                     const ChainSolution<Body>& solution);

}  // namespace occ::internal::smooth
