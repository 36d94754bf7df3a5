// SPDX-License-Identifier: Apache-2.0
// Where a vehicle is on a floor: SE(2). A pose is world_from_body, the body's x forward, y left, z
// up; headings are azimuths about the world's Z of the body's x axis.
//
// Covariance (3x3): order [x_m, y_m, heading_rad], along the world's axes. That of an increment is
// along the axes of the body before it.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

struct LIBOCC_API PlanarPose {
  double x_m = 0, y_m = 0, heading_rad = 0;

  Eigen::Vector2d position() const { return {x_m, y_m}; }
  Eigen::Vector2d forward() const;  ///< unit
  Eigen::Vector2d left() const;     ///< unit

  /// Where a point of the body's frame is in the world.
  Eigen::Vector2d operator*(const Eigen::Vector2d& point) const;

  /// This pose moved on by an increment in its own frame; the heading is in (-pi, pi].
  PlanarPose operator*(const PlanarPose& increment) const;
  PlanarPose inverse() const;

  bool finite() const;
};

/// The same angle in (-pi, pi].
LIBOCC_API double wrapped_rad(double angle_rad);

/// [x, y, heading] of `to` less those of `from`, the heading the short way round.
LIBOCC_API Eigen::Vector3d difference(const PlanarPose& to, const PlanarPose& from);

/// Where a body gets to that drives forward and turns at constant rates: an arc.
LIBOCC_API PlanarPose arc(double length_m, double turn_rad);

/// Where a body gets to at constant [forward, left, turn]: the exponential of SE(2).
LIBOCC_API PlanarPose planar_exp(const Eigen::Vector3d& motion);

/// The motion with planar_exp(motion) == pose that turns by no more than half a turn.
LIBOCC_API Eigen::Vector3d planar_log(const PlanarPose& pose);

/// body_from_world of a body that stands upright, its origin at this height.
LIBOCC_API Rigid3 body_from_world(const PlanarPose& pose, double height_m = 0);

/// The planar part of a body's pose: its origin, and the azimuth of its x axis.
LIBOCC_API PlanarPose planar_pose(const Rigid3& body_from_world);

}  // namespace occ
