// SPDX-License-Identifier: Apache-2.0
// Solves a chain: maximum-likelihood poses (Levenberg-Marquardt), their covariances, and the test
// of the odometry steps for gross errors.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
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

/// Sets the corners of the robust losses from the options.
template <class Body>
void set_corners(Chain<Body>& chain, const SmootherOptions& options);

/// Minimises from `poses`. Sets the reports of the links and the marks of sightings aside.
template <class Body>
ChainSolution<Body> solved(Chain<Body>& chain, std::vector<typename Body::Pose> poses,
                           const SmootherOptions& options);

}  // namespace occ::internal::smooth
