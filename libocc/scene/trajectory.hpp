// SPDX-License-Identifier: Apache-2.0
// Where a camera is over time: waypoints, and between two of them the screw motion that takes one
// to the other, the geodesic of SE(3): T(t) = Exp(velocity (t - t0)) T(t0). Its velocity is the
// renderer's (SimulateOptions::velocity), constant between waypoints: there an image rendered with
// it is exact for every row. Turns between waypoints are the shorter way round.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

struct Waypoint {
  double time_s = 0;
  Rigid3 cam_from_world;
};

class LIBOCC_API Trajectory {
 public:
  /// Throws std::invalid_argument naming the waypoint when there is none, times do not increase, or
  /// a time or a pose is not finite.
  explicit Trajectory(std::vector<Waypoint> waypoints);

  const std::vector<Waypoint>& waypoints() const { return waypoints_; }
  double begin_s() const { return waypoints_.front().time_s; }
  double end_s() const { return waypoints_.back().time_s; }

  /// Throws std::invalid_argument for a time before the first waypoint or after the last.
  Rigid3 cam_from_world(double time_s) const;

  /// At a waypoint, that of what follows; zero when there is only one waypoint.
  Vector6 velocity(double time_s) const;

  /// The constant velocity that takes the pose at one time to the pose at another: what an image
  /// needs whose rows are exposed between them.
  Vector6 velocity(double from_s, double to_s) const;

 private:
  std::size_t segment(double time_s) const;

  std::vector<Waypoint> waypoints_;
  std::vector<Vector6> velocities_;  // after each waypoint but the last
};

/// TUM's format: lines `t tx ty tz qx qy qz qw`, the camera's pose in the world, `#` a comment.
/// Throws std::runtime_error "FILE:LINE: REASON, got VALUE"; a quaternion may be as far from unit
/// as a few digits make it.
LIBOCC_API Trajectory read_trajectory(const std::string& path);

/// The same from text; `name` stands for the file in messages.
LIBOCC_API Trajectory parse_trajectory(const std::string& text, const std::string& name = "<text>");

/// Text that parse_trajectory reads back, poses to rounding.
LIBOCC_API std::string format_trajectory(const Trajectory& trajectory);

/// Writes whole or not at all. Throws std::runtime_error naming the file.
LIBOCC_API void write_trajectory(const std::string& path, const Trajectory& trajectory);

}  // namespace occ
