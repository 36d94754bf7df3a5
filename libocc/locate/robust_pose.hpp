// SPDX-License-Identifier: Apache-2.0
// Pose from 3D-2D point correspondences with many outliers: RANSAC with local optimisation
// (pose/internal/consensus.hpp), then least squares over the inliers, and the covariance. A pose is
// accepted if random correspondences would hardly produce as many inliers with residuals as small
// (number of false alarms, pose/internal/false_alarms.hpp). Random pixels are uniform in the
// rectangle of all pixels or, in crowded areas, those of other points.
//
// If part of the points moved, or the scene repeats, two poses may each have many inliers. A second
// pose is searched among the points that are far from the first (three gates).
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

/// Options of robust_pose().
struct LIBOCC_API RobustPoseOptions {
  double sigma_px = 1;             ///< standard deviation of an inlier's pixel coordinates
  double gate_sigmas = 4;          ///< inlier limit; 1 of 3000 correct correspondences is beyond
  double confidence = 0.9999;      ///< probability that a sample without outliers was drawn
  int max_iterations = 100000;     ///< number of samples; about 60 ms for 200 points
  double max_false_alarms = 1e-4;  ///< expected number of random poses as good as the best
  std::uint64_t seed = 0;          ///< equal seeds give equal bits
  /// The world's Z axis in the camera's frame (unit vector), if known: samples then have two
  /// points.
  std::optional<Eigen::Vector3d> up_in_cam;
  /// Standard deviation of up_in_cam about each axis. It is not an observation of the final fit; a
  /// pose more than five sigmas off is rejected.
  double up_sigma_rad = 0.01;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Pose from correspondences with outliers.
struct RobustPose {
  Fix fix;                          ///< fitted to the inliers by solve_pose
  std::vector<bool> inliers;        ///< one for each point
  double inlier_ratio = 0;          ///< share of inliers, 0 to 1
  int iterations = 0;               ///< number of samples
  double log10_false_alarms = 300;  ///< log10 of the expected number of random poses as good
};

/// points_in_world: columns [m]; points_px: columns, same count. The risk of the fix is that of
/// solve_pose() for the inliers plus the expected number of random poses as good; two poses with
/// different inliers have probabilities as if each were equally likely to explain a point. Status:
/// ok; ambiguous (several poses fit the inliers equally well, or a second pose has about as many
/// inliers of its own; all are in the fix); too_few_lamps (fewer than four points, three with
/// up_in_cam); degenerate (points or inliers that coincide or lie on a line); no_pose (not more
/// inliers than random correspondences give, or a contradiction to up_in_cam; the value holds the
/// best pose); not_converged. Throws std::invalid_argument for counts that differ, values that are
/// not finite, pixels outside the camera's domain, or options out of range.
LIBOCC_API Result<RobustPose> robust_pose(const Eigen::Matrix3Xd& points_in_world,
                                          const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                          const RobustPoseOptions& options = {});

}  // namespace occ
