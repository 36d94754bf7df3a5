// SPDX-License-Identifier: Apache-2.0
// The poses of a camera over time, interpolated between waypoints by screw motions, the geodesics
// of SE(3):
//
//   T(t) = Exp(velocity (t - t0)) T(t0)
//
// The velocity is constant between waypoints and defined as SimulateOptions::velocity, so an image
// rendered with it is exact for every row. Rotations between waypoints are by less than pi.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Pose of the camera at one time.
struct Waypoint {
  double time_s = 0;      ///< must increase from way-point to way-point
  Rigid3 cam_from_world;  ///< pose at that time
};

/// Continuous motion through way-points; immutable.
class LIBOCC_API Trajectory {
 public:
  /// Throws std::invalid_argument naming the waypoint when there is none, times do not increase, or
  /// a time or a pose is not finite.
  explicit Trajectory(std::vector<Waypoint> waypoints);

  /// Way-points as given, in the order of time.
  const std::vector<Waypoint>& waypoints() const { return waypoints_; }
  /// Time of the first way-point.
  double begin_s() const { return waypoints_.front().time_s; }
  /// Time of the last way-point.
  double end_s() const { return waypoints_.back().time_s; }

  /// Throws std::invalid_argument for a time before the first waypoint or after the last.
  Rigid3 cam_from_world(double time_s) const;

  /// Velocity at a time; at a waypoint that of the following segment; zero for a single waypoint.
  Vector6 velocity(double time_s) const;

  /// The constant velocity that moves the pose at one time to the pose at another: the velocity of
  /// an image whose rows are exposed between these times.
  Vector6 velocity(double from_s, double to_s) const;

 private:
  std::size_t segment(double time_s) const;

  std::vector<Waypoint> waypoints_;
  std::vector<Vector6> velocities_;  // of the segments between waypoints
};

/// Reads waypoints (YAML, libocc-trajectory/1, data/trajectories/README.md) or TUM's format: lines
/// `t tx ty tz qx qy qz qw`, the camera's pose in the world; `#` starts a comment. Quaternions are
/// normalised; a norm that differs from 1 by more than 0.01 is an error. Throws std::runtime_error
/// "FILE:LINE: REASON, got VALUE".
LIBOCC_API Trajectory read_trajectory(const std::string& path);

/// Reads a trajectory from text; messages use `name` in place of a file name.
LIBOCC_API Trajectory parse_trajectory(const std::string& text, const std::string& name = "<text>");

/// Text that parse_trajectory reads back to the same poses up to rounding.
LIBOCC_API std::string format_trajectory(const Trajectory& trajectory);

/// Writes the file completely or leaves it unchanged. Throws std::runtime_error naming the file.
LIBOCC_API void write_trajectory(const std::string& path, const Trajectory& trajectory);

}  // namespace occ
