// SPDX-License-Identifier: Apache-2.0
// Internal: the most likely poses of a chain (Levenberg, Marquardt), their covariance, and which
// odometry steps the rest contradicts.
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

/// `poses`: where to start. Sets the links' reports, and what is aside.
template <class Body>
ChainSolution<Body> solved(Chain<Body>& chain, std::vector<typename Body::Pose> poses,
                           const SmootherOptions& options);

/// What is said of a solution: status and message, poses with covariances, statistics.
template <class Body>
Result<Smoothing<typename Body::Smoothed>> told(const Chain<Body>& chain,
                                                const ChainSolution<Body>& solution);

}  // namespace occ::internal::smooth
