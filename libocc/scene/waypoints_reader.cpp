// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/waypoints_reader.hpp"

#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "libocc/core/internal/yaml_section.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::scene {

using namespace core;
namespace {

// Orientation of a camera that looks up, its image's right side at the azimuth heading_rad, tilted
// by tilt_rad towards the azimuth towards_rad.
Eigen::Matrix3d upward_rotation(double heading_rad, double tilt_rad, double towards_rad) {
  Eigen::Matrix3d level;
  level << std::cos(heading_rad), std::sin(heading_rad), 0,  //
      -std::sin(heading_rad), std::cos(heading_rad), 0,      //
      0, 0, 1;
  const Eigen::Vector3d axis(-std::sin(towards_rad), std::cos(towards_rad), 0);
  return level * so3_exp(-tilt_rad * axis);
}

Rigid3 read_pose(YamlSection& waypoint) {
  Eigen::Vector3d position_m, look_at_m, up(0, 0, 1);
  double heading_deg = 0, tilt_deg = 0, tilt_towards_deg = 0;
  waypoint.need("position_m", position_m);
  waypoint.read("heading_deg", heading_deg);
  waypoint.read("tilt_deg", tilt_deg);
  waypoint.read("tilt_towards_deg", tilt_towards_deg);
  waypoint.read("look_at_m", look_at_m);
  waypoint.read("up", up);
  waypoint.reject_unknown();
  if (!waypoint.has("look_at_m")) {
    if (waypoint.has("up")) waypoint.fail_value("up", "must be absent without `look_at_m`");
    const double degree = pi / 180;
    const Eigen::Matrix3d rotation =
        upward_rotation(heading_deg * degree, tilt_deg * degree, tilt_towards_deg * degree);
    return {rotation, -(rotation * position_m)};
  }
  for (const char* angle : {"heading_deg", "tilt_deg", "tilt_towards_deg"})
    if (waypoint.has(angle))
      waypoint.fail_value(angle, "must not be given together with `look_at_m`");
  Rigid3 pose;
  waypoint.check([&] { pose = look_at(position_m, look_at_m, up); }, "look_at_m");
  return pose;
}

}  // namespace

bool holds_waypoints(const std::string& text) {
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") != std::string::npos)
      return line.find(':') != std::string::npos;
  }
  return false;
}

Trajectory parse_waypoints(const std::string& text, const std::string& name) {
  const auto node = parse_yaml(text, name);
  YamlSection root(node, node->line, name, "");
  root.require_schema("libocc-trajectory/", 1);
  std::vector<Waypoint> waypoints;
  for (YamlSection& section : root.sections("waypoints")) {
    Waypoint waypoint;
    section.need("time_s", waypoint.time_s);
    if (!waypoints.empty() && !(waypoint.time_s > waypoints.back().time_s))
      section.fail_value("time_s", "must be later than the previous one");
    waypoint.cam_from_world = read_pose(section);
    waypoints.push_back(waypoint);
  }
  if (waypoints.empty()) root.fail_value("waypoints", "must be a list of at least one");
  root.reject_unknown();
  return Trajectory(std::move(waypoints));
}

}  // namespace occ::internal::scene
