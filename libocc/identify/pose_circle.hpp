// SPDX-License-Identifier: Apache-2.0
// Poses that the outline of one disc allows: a disc looks the same after a turn about its normal,
// so the camera may be anywhere on a circle about the disc's axis, turned with it. The sigmas
// contain the errors of the rim and of the lamp's size; its place and the camera's calibration are
// taken as exact.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// A circle of poses.
struct LIBOCC_API PoseCircle {
  int lamp = 0;  ///< index into Scene::lamps: the disc
  int blob = 0;  ///< index into the blobs: its image
  /// Pose at the angle 0, which is arbitrary.
  Rigid3 cam_from_world;
  /// Inverse covariance of the left perturbation of cam_from_world (geometry/rigid.hpp); zero for
  /// the turn about the axis. A filter may use it as an observation.
  Matrix6 information = Matrix6::Zero();
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< middle of the circle, in the world
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     ///< normal of the disc, in the world
  double radius_m = 0;                                 ///< distance of the camera from the axis
  double height_m = 0;        ///< distance of the camera from the disc, along the axis
  double radius_sigma_m = 0;  ///< standard deviation of radius_m
  double height_sigma_m = 0;  ///< standard deviation of height_m

  /// cam_from_world after the camera has moved along the circle by an angle about the axis.
  Rigid3 at(double angle_rad) const;
};

}  // namespace occ
