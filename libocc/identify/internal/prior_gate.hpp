// SPDX-License-Identifier: Apache-2.0
// Rejects poses of an upright camera that contradict the prior, before any fit. The camera is
// upright when its rotation is known from gravity except for the heading.
#pragma once

#include <optional>

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

/// A pose farther from the prior is rejected: before any fit, and as a hypothesis by its
/// chi-square.
inline constexpr double max_prior_sigmas = 6;
inline constexpr double max_prior_chi2 = max_prior_sigmas * max_prior_sigmas;

/// Rotation from a frame whose z axis points up to the camera frame. The prior must contain
/// gravity.
LIBOCC_API Eigen::Matrix3d cam_from_upright(const AssignmentProblem& problem);

/// Compares poses with the height, position, heading and last pose of the prior, at six sigma.
class LIBOCC_API PriorGate {
 public:
  PriorGate(const AssignmentProblem& problem, const Eigen::Matrix3d& cam_from_upright);

  /// position: of the camera, local frame [m]; cosine, sine: of the rotation about the vertical
  /// from the world to the upright frame; distance_m: distance of the first lamp; relative: error
  /// of the candidate pose, both as an angle [rad] and as a fraction of the distance.
  bool allows(const Eigen::Vector3d& position, double cosine, double sine, double distance_m,
              double relative) const;

  /// True if the prior contains nothing beyond gravity, so that allows() is always true.
  bool is_open() const { return !height_ && !position_ && !last_ && !heading_; }

 private:
  struct Around {
    Eigen::Vector3d position;   // local frame
    Eigen::Vector3d variances;  // along the axes
  };
  std::optional<Around> position_, last_;
  std::optional<double> height_;  // local frame
  double height_variance_ = 0;
  std::optional<Eigen::Vector2d> heading_;  // direction of the image's x axis, unit
  double heading_variance_ = 0;
  Eigen::Vector2d right_;  // horizontal part of the image's x axis in the upright frame
};

}  // namespace occ::internal::identify
