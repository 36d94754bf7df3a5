// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/route.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/require.hpp"
#include "libocc/guide/internal/route_shape.hpp"

namespace occ {

using namespace internal::guide;
namespace {

std::string waypoint_name(std::size_t i) { return "waypoints[" + std::to_string(i) + "]"; }

void require_waypoints(const std::vector<RouteWaypoint>& waypoints, const RouteOptions& options) {
  const std::size_t min_count = options.closed ? 3 : 2;
  require(waypoints.size() >= min_count, "waypoints", waypoints.size(),
          options.closed ? "at min_distance three for a closed route" : "at min_distance two");
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const RouteWaypoint& waypoint = waypoints[i];
    const std::string name = waypoint_name(i);
    require(waypoint.position_m.allFinite(), name + ".position_m", waypoint.position_m.transpose(),
            "finite");
    if (waypoint.corner_radius_m)
      require(std::isfinite(*waypoint.corner_radius_m) && *waypoint.corner_radius_m >= 0,
              name + ".corner_radius_m", *waypoint.corner_radius_m, "finite and >= 0");
    if (waypoint.speed_m_s)
      require(std::isfinite(*waypoint.speed_m_s) && *waypoint.speed_m_s > 0, name + ".speed_m_s",
              *waypoint.speed_m_s, "positive");
    if (i + 1 == waypoints.size() && !options.closed) break;
    const RouteWaypoint& next = waypoints[(i + 1) % waypoints.size()];
    require((next.position_m - waypoint.position_m).norm() > 1e-9,
            waypoint_name((i + 1) % waypoints.size()) + ".position_m", next.position_m.transpose(),
            "different from the previous one");
  }
}

PlanarPose pose_on(const RoutePiece& piece, double along_m) {
  return piece.begin * arc(along_m, along_m * piece.curvature_1_m);
}

/// Returns the nearest point of a piece, as a length from its begin within [from_m, to_m].
double nearest_on(const RoutePiece& piece, const Eigen::Vector2d& position, double from_m,
                  double to_m) {
  const Eigen::Vector2d off = position - piece.begin.position();
  const double ahead = off.dot(piece.begin.forward()), left = off.dot(piece.begin.left());
  if (piece.curvature_1_m == 0) return std::clamp(ahead, from_m, to_m);
  // Angle of the position about the arc's centre, measured from the begin.
  const double curvature = std::abs(piece.curvature_1_m);
  const double side = piece.curvature_1_m > 0 ? left : -left;
  const double angle = std::atan2(ahead, 1 / curvature - side);
  const double middle = 0.5 * (from_m + to_m) * curvature;
  return std::clamp((middle + wrapped_rad(angle - middle)) / curvature, from_m, to_m);
}

RoutePlace place_on(const RoutePiece& piece, double along_m) {
  return {piece.begin_m + along_m, pose_on(piece, along_m), 0, piece.curvature_1_m,
          piece.speed_m_s};
}

}  // namespace

void RouteOptions::validate() const {
  require(laps >= 1, "laps", laps, ">= 1");
  require(closed || laps == 1, "laps", laps, "1 for an open route");
  require(std::isfinite(corner_radius_m) && corner_radius_m >= 0, "corner_radius_m",
          corner_radius_m, "finite and >= 0");
  require(std::isfinite(speed_m_s) && speed_m_s > 0, "speed_m_s", speed_m_s, "positive");
  if (dock)
    require(dock->finite(), "dock", Eigen::RowVector3d(dock->x_m, dock->y_m, dock->heading_rad),
            "finite");
}

Route::Route(const std::vector<RouteWaypoint>& waypoints, const RouteOptions& options)
    : waypoints_(waypoints), options_(options) {
  options.validate();
  require_waypoints(waypoints, options);
  const std::vector<RoutePiece> lap = options.shape == RouteShape::lines
                                          ? rounded_lines(waypoints, options)
                                          : spline_arcs(waypoints, options);
  double along_m = 0;
  for (int i = 0; i < options.laps; ++i) {
    for (RoutePiece piece : lap) {
      piece.begin_m = along_m;
      along_m += piece.length_m;
      pieces_.push_back(piece);
    }
  }
}

RoutePlace Route::at(double along_m) const {
  require(!std::isnan(along_m), "along_m", along_m, "a number");
  const double clipped_m = std::clamp(along_m, 0.0, length_m());
  const auto after =
      std::upper_bound(pieces_.begin() + 1, pieces_.end(), clipped_m,
                       [](double m, const RoutePiece& piece) { return m < piece.begin_m; });
  const RoutePiece& piece = *(after - 1);
  return place_on(piece, std::min(clipped_m - piece.begin_m, piece.length_m));
}

RoutePlace Route::nearest(const Eigen::Vector2d& position_m, std::optional<double> near_m,
                          double window_m) const {
  require(position_m.allFinite(), "position_m", position_m.transpose(), "finite");
  const double low_m = near_m ? std::clamp(*near_m - window_m, 0.0, length_m()) : 0;
  const double high_m = near_m ? std::clamp(*near_m + window_m, 0.0, length_m()) : length_m();
  RoutePlace best;
  double min_distance = std::numeric_limits<double>::infinity();
  for (const RoutePiece& piece : pieces_) {
    const double from_m = std::max(low_m - piece.begin_m, 0.0);
    const double to_m = std::min(high_m - piece.begin_m, piece.length_m);
    if (from_m > to_m) continue;
    const RoutePlace place = place_on(piece, nearest_on(piece, position_m, from_m, to_m));
    const double distance = (position_m - place.pose.position()).norm();
    if (!(distance < min_distance)) continue;
    min_distance = distance;
    best = place;
  }
  best.deviation_m = (position_m - best.pose.position()).dot(best.pose.left());
  return best;
}

RoutePlace Route::ahead(const Eigen::Vector2d& position_m, double along_m,
                        double distance_m) const {
  require(std::isfinite(distance_m) && distance_m > 0, "distance_m", distance_m, "positive");
  const auto beyond = [&](double m) {
    return (at(m).pose.position() - position_m).norm() >= distance_m;
  };
  const double step_m = 0.25 * distance_m;
  double low_m = std::clamp(along_m, 0.0, length_m());
  while (low_m < length_m() && !beyond(low_m + step_m)) low_m += step_m;
  double high_m = std::min(low_m + step_m, length_m());
  if (!beyond(high_m)) return at(length_m());
  for (int i = 0; i < 40; ++i) {
    const double middle_m = 0.5 * (low_m + high_m);
    (beyond(middle_m) ? high_m : low_m) = middle_m;
  }
  return at(high_m);
}

std::vector<RoutePlace> Route::sampled(double step_m) const {
  require(std::isfinite(step_m) && step_m > 0, "step_m", step_m, "positive");
  std::vector<RoutePlace> places;
  for (const RoutePiece& piece : pieces_) {
    const int count = std::max(1, static_cast<int>(std::ceil(piece.length_m / step_m)));
    for (int i = 0; i < count; ++i) places.push_back(place_on(piece, piece.length_m * i / count));
  }
  places.push_back(at(length_m()));
  return places;
}

}  // namespace occ
