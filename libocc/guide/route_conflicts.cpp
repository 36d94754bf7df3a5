// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "libocc/core/require.hpp"
#include "libocc/guide/route.hpp"

namespace occ {
namespace {

constexpr double look_every_m = 0.005;

/// Distance from a point to a box's outline on the floor; negative inside.
double distance_to_box(const Box& box, const Eigen::Vector2d& position) {
  const Eigen::Vector2d outside =
      (box.min_m.head<2>() - position).cwiseMax(position - box.max_m.head<2>());
  return outside.cwiseMax(0).norm() + std::min(outside.maxCoeff(), 0.0);
}

double distance_to_walls(const Room& room, const Eigen::Vector2d& position) {
  return std::min(position.minCoeff(), (room.size_m.head<2>() - position).minCoeff());
}

/// Joins consecutive conflicts with the same object.
class Conflicts {
 public:
  void add(double along_m, const Eigen::Vector2d& position, double clearance,
           const std::string& what) {
    const bool goes_on = !found_.empty() && found_.back().what == what &&
                         along_m - found_.back().to_m < 2 * look_every_m;
    if (!goes_on)
      found_.push_back({along_m, along_m, position, std::numeric_limits<double>::infinity(), what});
    RouteConflict& conflict = found_.back();
    conflict.to_m = along_m;
    if (!(clearance < conflict.clearance_m)) return;
    conflict.clearance_m = clearance;
    conflict.position_m = position;
  }
  std::vector<RouteConflict> found() && { return std::move(found_); }

 private:
  std::vector<RouteConflict> found_;
};

}  // namespace

double clearance_m(const Scene& scene, const Eigen::Vector2d& position_m, double radius_m,
                   double height_m, std::string* what) {
  double min_clearance_m = std::numeric_limits<double>::infinity();
  const auto nearer = [&](double distance_m, const std::string& name) {
    if (!(distance_m - radius_m < min_clearance_m)) return;
    min_clearance_m = distance_m - radius_m;
    if (what) *what = name;
  };
  if (scene.room) nearer(distance_to_walls(*scene.room, position_m), "a wall");
  for (std::size_t i = 0; i < scene.boxes.size(); ++i)
    if (scene.boxes[i].min_m.z() < height_m)
      nearer(distance_to_box(scene.boxes[i], position_m), "boxes[" + std::to_string(i) + "]");
  return min_clearance_m;
}

std::vector<RouteConflict> route_conflicts(const Route& route, const Scene& scene, double radius_m,
                                           double height_m) {
  require(std::isfinite(radius_m) && radius_m >= 0, "radius_m", radius_m, "finite and >= 0");
  require(std::isfinite(height_m) && height_m > 0, "height_m", height_m, "positive");
  Conflicts conflicts;
  const auto look = [&](double along_m, const Eigen::Vector2d& position) {
    std::string what;
    const double clearance = clearance_m(scene, position, radius_m, height_m, &what);
    if (clearance < 0) conflicts.add(along_m, position, clearance, what);
  };
  for (const RoutePlace& place : route.sampled(look_every_m))
    look(place.along_m, place.pose.position());
  if (route.dock()) look(route.length_m(), route.dock()->position());
  return std::move(conflicts).found();
}

void require_free(const Route& route, const Scene& scene, double radius_m, double height_m) {
  const std::vector<RouteConflict> conflicts = route_conflicts(route, scene, radius_m, height_m);
  if (conflicts.empty()) return;
  const RouteConflict& first = conflicts.front();
  std::ostringstream got;
  got << "one that touches " << first.what << " from " << first.from_m << " m to " << first.to_m
      << " m along it, " << -first.clearance_m << " m deep at (" << first.position_m.x() << ", "
      << first.position_m.y() << ")";
  require(false, "route", got.str(), "free of walls and boxes");
}

}  // namespace occ
