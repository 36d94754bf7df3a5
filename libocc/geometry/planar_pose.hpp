// SPDX-License-Identifier: Apache-2.0
// Pose of a vehicle on a floor: SE(2). A pose is world_from_body, with the body's x forward, y
// left, z up. The heading is the azimuth of the body's x axis about the world's Z axis.
//
// Covariance (3x3): order [x_m, y_m, heading_rad], along the world's axes. The covariance of an
// increment is along the axes of the body before the increment.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Pose on a floor: world_from_body of a body that moves in the plane.
struct LIBOCC_API PlanarPose {
  /// Origin of the body in the world, and azimuth of its x axis.
  double x_m = 0, y_m = 0, heading_rad = 0;

  /// Origin of the body in the world [m].
  Eigen::Vector2d position() const { return {x_m, y_m}; }
  Eigen::Vector2d forward() const;  ///< unit
  Eigen::Vector2d left() const;     ///< unit

  /// Position in the world of a point in the body frame.
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const;

  /// This pose after an increment in its own frame; the heading is in (-pi, pi].
  PlanarPose operator*(const PlanarPose& increment) const;
  /// Pose of the world in the body frame.
  PlanarPose inverse() const;

  /// True if no number is NaN or infinite.
  bool finite() const;
};

/// Equivalent angle in (-pi, pi].
LIBOCC_API double wrapped_rad(double angle_rad);

/// [x, y, heading] of `to` minus those of `from`; the difference of headings is in (-pi, pi].
LIBOCC_API Eigen::Vector3d difference(const PlanarPose& to, const PlanarPose& from);

/// Increment of a body that drives forward and turns at constant rates: an arc.
LIBOCC_API PlanarPose arc(double length_m, double turn_rad);

/// Increment at constant velocity, with the motion [forward m, left m, turn rad]: exponential of
/// SE(2).
LIBOCC_API PlanarPose planar_exp(const Eigen::Vector3d& motion);

/// Motion with planar_exp(motion) == pose and a turn of at most pi.
LIBOCC_API Eigen::Vector3d planar_log(const PlanarPose& pose);

/// body_from_world of an upright body with its origin at this height.
LIBOCC_API Rigid3 body_from_world(const PlanarPose& pose, double height_m = 0);

/// Planar part of a body's pose: x and y of its origin, azimuth of its x axis.
LIBOCC_API PlanarPose planar_pose(const Rigid3& body_from_world);

}  // namespace occ
