// SPDX-License-Identifier: Apache-2.0
// From points and where they were seen, many of them matched wrongly, to a fix: the pose that most
// of them agree with (RANSAC with local optimisation, pose/internal/consensus.hpp), then least
// squares over those who agree, and its covariance. It is said to be found when chance alone would
// hardly bring so many together: pixels anywhere in the rectangle that they span, or other points'
// pixels where they are crowded (pose/internal/false_alarms.hpp).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/locate/fix.hpp"

namespace occ {

struct LIBOCC_API RobustPoseOptions {
  double sigma_px = 1;          ///< of a right match's pixel coordinate, along each axis
  double gate_sigmas = 4;       ///< further off in the image a match is wrong; 1 in 3000 right ones
  double confidence = 0.9999;   ///< that a sample without a wrong match was drawn
  int max_iterations = 100000;  ///< samples; some 60 ms for 200 points
  double max_false_alarms = 1e-4;            ///< poses as good as the best that chance would bring
  std::uint64_t seed = 0;                    ///< the same bits for the same seed
  std::optional<Eigen::Vector3d> up_in_cam;  ///< world's Z in the camera's frame (unit), when
                                             ///< known: samples are then of two points
  double up_sigma_rad = 0.01;  ///< of up_in_cam, about each axis; the points decide, and a pose
                               ///< more than five sigmas from it is refused

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct RobustPose {
  Fix fix;                    ///< from the inliers, as by solve_pose
  std::vector<bool> inliers;  ///< of each point
  double inlier_ratio = 0;
  int iterations = 0;               ///< samples drawn
  double log10_false_alarms = 300;  ///< how many poses as good as this chance would bring
};

/// points_in_world: columns [m]; points_px: columns, same count. Status: ok; ambiguous (several
/// poses fit the inliers equally well, all are in the fix); too_few_lamps (fewer than four points,
/// three when up_in_cam is known); degenerate (points, or inliers, that coincide or lie on a line);
/// no_pose (no more points agree than chance explains, or they contradict up_in_cam; the best is in
/// the value); not_converged. Throws std::invalid_argument for counts that differ, values that are
/// not finite, pixels outside the camera's domain, or options out of range.
LIBOCC_API Result<RobustPose> robust_pose(const Eigen::Matrix3Xd& points_in_world,
                                          const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                          const RobustPoseOptions& options = {});

}  // namespace occ
