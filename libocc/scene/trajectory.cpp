// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/geometry/motion.hpp"

namespace occ {

Trajectory::Trajectory(std::vector<Waypoint> waypoints) : waypoints_(std::move(waypoints)) {
  require(!waypoints_.empty(), "waypoints", waypoints_.size(), "at least one");
  for (std::size_t i = 0; i < waypoints_.size(); ++i) {
    const std::string name = "waypoints[" + std::to_string(i) + "]";
    Waypoint& waypoint = waypoints_[i];
    require(std::isfinite(waypoint.time_s), name + ".time_s", waypoint.time_s, "finite");
    waypoint.cam_from_world =
        Rigid3::from_matrix(waypoint.cam_from_world.matrix(), (name + ".cam_from_world").c_str());
    if (i == 0) continue;
    const Waypoint& before = waypoints_[i - 1];
    require(waypoint.time_s > before.time_s, name + ".time_s", waypoint.time_s,
            "later than the previous one");
    velocities_.push_back(velocity_between(before.cam_from_world, waypoint.cam_from_world,
                                           waypoint.time_s - before.time_s));
  }
}

std::size_t Trajectory::segment(double time_s) const {
  const std::string rule =
      "from " + std::to_string(begin_s()) + " to " + std::to_string(end_s()) + " s";
  require(time_s >= begin_s() && time_s <= end_s(), "time_s", time_s, rule);
  const auto after =
      std::upper_bound(waypoints_.begin(), waypoints_.end(), time_s,
                       [](double time, const Waypoint& w) { return time < w.time_s; });
  return static_cast<std::size_t>(after - waypoints_.begin()) - 1;
}

Rigid3 Trajectory::cam_from_world(double time_s) const {
  const std::size_t i = segment(time_s);
  const Waypoint& from = waypoints_[i];
  if (i == velocities_.size()) return from.cam_from_world;
  return moved_pose(from.cam_from_world, velocities_[i], time_s - from.time_s);
}

Vector6 Trajectory::velocity(double time_s) const {
  const std::size_t i = segment(time_s);
  if (velocities_.empty()) return Vector6::Zero();
  return velocities_[std::min(i, velocities_.size() - 1)];
}

Vector6 Trajectory::velocity(double from_s, double to_s) const {
  require(to_s >= from_s, "to_s", to_s, "no earlier than from_s");
  const std::size_t i = segment(from_s);
  // Within one segment the velocity is known exactly; a difference of poses over milliseconds would
  // amplify rounding.
  const bool within = i < velocities_.size() && to_s <= waypoints_[i + 1].time_s;
  if (within || to_s == from_s) return velocity(from_s);
  return velocity_between(cam_from_world(from_s), cam_from_world(to_s), to_s - from_s);
}

}  // namespace occ
