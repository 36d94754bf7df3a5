// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/yaml_node.hpp"
#include "libocc/scene/internal/waypoints_reader.hpp"
#include "libocc/scene/trajectory.hpp"

namespace occ {

using namespace internal::core;
namespace {

constexpr double unit_tolerance =
    1e-2;  // error of the norm of a quaternion written with two digits
using Numbers = std::array<double, 8>;

[[noreturn]] void fail(const std::string& name, int line, const std::string& reason) {
  throw std::runtime_error(name + ":" + std::to_string(line) + ": " + reason);
}

double number(const std::string& word, const std::string& name, int line) {
  double value = 0;
  const char* end = word.data() + word.size();
  const auto parsed = std::from_chars(word.data(), end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(value))
    fail(name, line, "must be finite numbers, got " + printable(word));
  return value;
}

Numbers numbers_of(const std::string& text, const std::string& name, int line) {
  std::istringstream stream(text);
  Numbers numbers{};
  std::size_t count = 0;
  for (std::string word; stream >> word; ++count) {
    const double value = number(word, name, line);
    if (count < numbers.size()) numbers[count] = value;
  }
  if (count != numbers.size())
    fail(name, line, "must be 8 numbers, t tx ty tz qx qy qz qw, got " + std::to_string(count));
  return numbers;
}

Waypoint waypoint_of(const Numbers& n, const std::string& name, int line) {
  const Eigen::Quaterniond q(n[7], n[4], n[5], n[6]);
  if (!(std::abs(q.norm() - 1) < unit_tolerance)) {
    std::ostringstream reason;
    reason << "qx qy qz qw must be a unit quaternion, got norm " << q.norm();
    fail(name, line, reason.str());
  }
  const Rigid3 world_from_cam{q.normalized().toRotationMatrix(), {n[1], n[2], n[3]}};
  return {n[0], world_from_cam.inverse()};
}

}  // namespace

Trajectory parse_trajectory(const std::string& text, const std::string& name) {
  if (internal::scene::holds_waypoints(text)) return internal::scene::parse_waypoints(text, name);
  std::vector<Waypoint> waypoints;
  std::istringstream stream(text);
  int line = 0;
  for (std::string row; std::getline(stream, row);) {
    ++line;
    row = row.substr(0, row.find('#'));
    if (row.find_first_not_of(" \t\r") == std::string::npos) continue;
    waypoints.push_back(waypoint_of(numbers_of(row, name, line), name, line));
    const std::size_t last = waypoints.size() - 1;
    if (last > 0 && !(waypoints[last].time_s > waypoints[last - 1].time_s))
      fail(name, line, "times must increase, got " + printable(row));
  }
  if (waypoints.empty()) throw std::runtime_error(name + ": contains no pose");
  return Trajectory(std::move(waypoints));
}

Trajectory read_trajectory(const std::string& path) {
  return parse_trajectory(read_file(path), path);
}

std::string format_trajectory(const Trajectory& trajectory) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(std::numeric_limits<double>::max_digits10);
  text << "# t tx ty tz qx qy qz qw: the camera's pose in the world [s, m]\n";
  for (const Waypoint& waypoint : trajectory.waypoints()) {
    const Rigid3 pose = waypoint.cam_from_world.inverse();
    Eigen::Quaterniond q(pose.rotation);
    if (q.w() < 0) q.coeffs() *= -1;
    text << waypoint.time_s;
    for (const double value : pose.translation) text << ' ' << value;
    text << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  }
  return text.str();
}

void write_trajectory(const std::string& path, const Trajectory& trajectory) {
  const std::string text = format_trajectory(trajectory);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
