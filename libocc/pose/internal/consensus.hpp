// SPDX-License-Identifier: Apache-2.0
// Internal: the pose that most points agree with, when some were matched wrongly. Poses from random
// samples of three points (two when the vertical is known) are ranked by a truncated sum of squares
// (Torr, Zisserman, "MLESAC", CVIU 78, 2000, section 3: MSAC), wider than the final one as a sample
// carries its own noise; each that beats all before it is improved by least squares over those who
// agree (Chum, Matas, Kittler, "Locally optimized RANSAC", DAGM 2003), until one more sample would
// hardly find better (Fischler, Bolles, "Random sample consensus", CACM 24, 1981, section II.B).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/point_fit.hpp"

namespace occ::internal::pose {

struct ConsensusOptions {
  double gate_sigmas = 4;      ///< beyond, a point disagrees
  double sample_sigmas = 12;   ///< the same for a pose from a sample
  double confidence = 0.9999;  ///< that a sample without a wrong match was drawn
  int max_iterations = 100000;
  int min_inliers = 4;  ///< fewer are of no interest, nor looked for any longer
  std::uint64_t seed = 0;
  std::optional<Eigen::Vector3d> up_in_cam;
};

struct Consensus {
  Rigid3 pose;               ///< of the points' frame
  std::vector<int> inliers;  ///< ascending; empty when no sample gave a pose
  double cost = 0;           ///< inliers: chi2 over the gate's; others 1 each
  int iterations = 0;        ///< samples drawn
  bool confident = false;    ///< false: stopped by max_iterations
};

/// Points about their frame's origin, in units of their size; bearings with a positive z.
Consensus find_consensus(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& bearings,
                         const SeenPoints& seen, const ConsensusOptions& options);

}  // namespace occ::internal::pose
