// SPDX-License-Identifier: Apache-2.0
// Internal: which poses of an upright camera a prior leaves, told before any fit.
#pragma once

#include <optional>

#include "libocc/identify/internal/problem.hpp"

namespace occ::internal::identify {

/// The rotation from a frame with its z up, when the prior knows gravity.
Eigen::Matrix3d cam_from_upright(const AssignmentProblem& problem);

/// Cuts off what is so far from the prior that no explanation with it would be believed.
class PriorGate {
 public:
  /// What a prior says of poses turned by `cam_from_upright` and then about the vertical.
  PriorGate(const AssignmentProblem& problem, const Eigen::Matrix3d& cam_from_upright);

  /// place: of the camera, local frame; cosine, sine: of the turn from the world to the upright
  /// frame; relative: error of the pose as voted on, a part of its distance and an angle alike.
  bool allows(const Eigen::Vector3d& place, double cosine, double sine, double distance_m,
              double relative) const;

  /// Whether it allows all: the prior says nothing beyond gravity.
  bool is_open() const { return !height_ && !position_ && !last_ && !heading_; }

 private:
  struct Around {
    Eigen::Vector3d place;      // local frame
    Eigen::Vector3d variances;  // along the axes
  };
  std::optional<Around> position_, last_;
  std::optional<double> height_;  // local frame
  double height_variance_ = 0;
  std::optional<Eigen::Vector2d> heading_;  // of the image's right, unit
  double heading_variance_ = 0;
  Eigen::Vector2d right_;  // the image's right in the upright frame, level part
};

}  // namespace occ::internal::identify
