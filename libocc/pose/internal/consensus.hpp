// SPDX-License-Identifier: Apache-2.0
// Pose from correspondences with outliers: locally optimised MSAC.
//
// Poses from random samples of three points (two when the vertical is known) are ranked by a
// truncated sum of squares (Torr, Zisserman, "MLESAC", CVIU 78, 2000, section 3: MSAC). Its gate is
// wider than the final one because a sample carries its own noise. Each new best pose is improved
// by least squares over its inliers (Chum, Matas, Kittler, "Locally optimized RANSAC", DAGM 2003).
// The number of samples follows from the best inlier ratio (Fischler, Bolles, "Random sample
// consensus", CACM 24, 1981, section II.B).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/point_fit.hpp"

namespace occ::internal::pose {

struct ConsensusOptions {
  double gate_sigmas = 4;       ///< limit of an inlier's residual
  double sample_sigmas = 12;    ///< limit for a pose from a sample, which carries its own noise
  double confidence = 0.9999;   ///< probability that a sample without an outlier was drawn
  int max_iterations = 100000;  ///< limit of the samples
  int min_inliers = 4;          ///< the search stops once poses with so many are ruled out
  std::uint64_t seed = 0;
  std::optional<Eigen::Vector3d> up_in_cam;
};

struct Consensus {
  Rigid3 pose;               ///< cam_from_points
  std::vector<int> inliers;  ///< ascending; empty when no sample gave a pose
  double cost = 0;           ///< sum over inliers of chi2 / gate^2, plus 1 for each outlier
  int iterations = 0;        ///< samples drawn
  bool confident = false;    ///< false: stopped by max_iterations
};

/// Points: about their frame's origin, in units of their size; bearings: unit, with a positive z.
LIBOCC_API Consensus find_consensus(const Eigen::Matrix3Xd& points,
                                    const Eigen::Matrix3Xd& bearings, const SeenPoints& seen,
                                    const ConsensusOptions& options);

}  // namespace occ::internal::pose
