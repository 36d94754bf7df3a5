// SPDX-License-Identifier: Apache-2.0
// Where a vehicle shall drive: straight lines joined by arcs, known by arc length. Way-points are
// joined by straight lines whose corners are rounded by circles, or by a smooth curve through all
// of them: a cubic spline over chord length, drawn by pairs of arcs that keep its directions
// (biarcs; Bolton, "Biarc curves", Computer-Aided Design 7, 1975).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

enum class RouteShape {
  lines,   ///< straight, corners rounded
  spline,  ///< smooth, through every way-point
};

struct RouteWaypoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  std::optional<double> corner_radius_m;  ///< instead of the route's; 0: a sharp corner
  std::optional<double> speed_m_s;        ///< from here on, instead of the one before
};

struct LIBOCC_API RouteOptions {
  RouteShape shape = RouteShape::lines;
  bool closed = false;             ///< the last way-point is followed by the first
  int laps = 1;                    ///< of a closed route
  double corner_radius_m = 0.3;    ///< smaller where a line is too short for it
  double speed_m_s = 0.5;          ///< at the first way-point
  std::optional<PlanarPose> dock;  ///< where the vehicle shall stand at the end

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A line, or an arc of constant curvature.
struct RoutePiece {
  PlanarPose begin;
  double begin_m = 0, length_m = 0;  ///< along the route
  double curvature_1_m = 0;          ///< left positive
  double speed_m_s = 0;
};

struct RoutePlace {
  double along_m = 0;      ///< from the route's begin
  PlanarPose pose;         ///< on the route, heading along it
  double deviation_m = 0;  ///< of what was asked about, to the left of the route
  double curvature_1_m = 0;
  double speed_m_s = 0;
};

class LIBOCC_API Route {
 public:
  /// Throws std::invalid_argument naming the way-point when there are fewer than two (closed:
  /// three), two that follow each other are at one place, a line turns back on itself under a
  /// radius, or a value is not finite; speeds are positive.
  explicit Route(const std::vector<RouteWaypoint>& waypoints, const RouteOptions& options = {});

  double length_m() const { return pieces_.back().begin_m + pieces_.back().length_m; }
  const std::vector<RoutePiece>& pieces() const { return pieces_; }
  const std::vector<RouteWaypoint>& waypoints() const { return waypoints_; }
  const RouteOptions& options() const { return options_; }
  const std::optional<PlanarPose>& dock() const { return options_.dock; }
  double lap_m() const {
    return length_m() / options_.laps;
  }  ///< of a route that is not closed: all

  /// Clipped to the route.
  RoutePlace at(double along_m) const;

  /// The nearest of its places; with `near_m` that within `window_m` of it along the route, for
  /// whoever knows how far it has come: laps and crossings look alike.
  RoutePlace nearest(const Eigen::Vector2d& position_m, std::optional<double> near_m = {},
                     double window_m = 0.5) const;

  /// The first place from along_m on that is distance_m away from `position_m`; the route's end
  /// when there is none.
  RoutePlace ahead(const Eigen::Vector2d& position_m, double along_m, double distance_m) const;

  /// Poses at most step_m apart, from begin to end.
  std::vector<RoutePlace> sampled(double step_m) const;

 private:
  std::vector<RoutePiece> pieces_;
  std::vector<RouteWaypoint> waypoints_;
  RouteOptions options_;
};

/// Where a vehicle would touch something.
struct RouteConflict {
  double from_m = 0, to_m = 0;                           ///< along the route
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< where it comes nearest
  double clearance_m = 0;                                ///< there; negative: inside
  std::string what;                                      ///< "a wall", "boxes[2]"
};

/// From a disc about `position_m` to the nearest wall or box that is no higher than height_m above
/// the floor; infinite where there is none. `what` may be null.
LIBOCC_API double clearance_m(const Scene& scene, const Eigen::Vector2d& position_m,
                              double radius_m, double height_m, std::string* what = nullptr);

/// In order of from_m; the dock is looked at, too. Boxes whose lower side is above `height_m` are
/// driven under. Throws std::invalid_argument for values out of range.
LIBOCC_API std::vector<RouteConflict> route_conflicts(const Route& route, const Scene& scene,
                                                      double radius_m, double height_m);

/// Throws std::invalid_argument saying where and what, when there are any.
LIBOCC_API void require_free(const Route& route, const Scene& scene, double radius_m,
                             double height_m);

}  // namespace occ
