// SPDX-License-Identifier: Apache-2.0
// Route of a vehicle: straight lines and arcs, parametrised by arc length. Way-points are joined by
// lines with corners rounded by circles, or by a smooth curve through all of them: a cubic spline
// over chord length, approximated by pairs of arcs with the spline's directions (biarcs; Bolton,
// "Biarc curves", Computer-Aided Design 7, 1975).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Curve through the way-points.
enum class RouteShape {
  lines,   ///< straight lines with rounded corners
  spline,  ///< smooth curve through every way-point
};

/// A corner of a route, or a point of its curve.
struct RouteWaypoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< in the world
  std::optional<double>
      corner_radius_m;              ///< replaces RouteOptions::corner_radius_m; 0: a sharp corner
  std::optional<double> speed_m_s;  ///< speed from here on; default: unchanged
};

/// Options of a Route.
struct LIBOCC_API RouteOptions {
  RouteShape shape = RouteShape::lines;  ///< curve through the way-points
  bool closed = false;                   ///< joins the last way-point to the first
  int laps = 1;                          ///< number of laps of a closed route
  double corner_radius_m = 0.3;          ///< reduced where a line is too short for it
  double speed_m_s = 0.5;                ///< speed at the first way-point
  std::optional<PlanarPose> dock;        ///< pose of the vehicle at the end

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A line, or an arc of constant curvature.
struct RoutePiece {
  PlanarPose begin;                  ///< pose at its begin, heading along the route
  double begin_m = 0, length_m = 0;  ///< distance along the route
  double curvature_1_m = 0;          ///< left positive
  double speed_m_s = 0;              ///< speed of the vehicle on it
};

/// A point of a route.
struct RoutePlace {
  double along_m = 0;        ///< distance from the begin of the route
  PlanarPose pose;           ///< pose on the route, heading along it
  double deviation_m = 0;    ///< offset of the queried position to the left of the route
  double curvature_1_m = 0;  ///< left positive
  double speed_m_s = 0;      ///< speed of the vehicle there
};

/// A route of lines and arcs; immutable.
class LIBOCC_API Route {
 public:
  /// Throws std::invalid_argument naming the way-point if there are fewer than two (three for a
  /// closed route), two consecutive ones coincide, a line reverses within a rounded corner, a speed
  /// is not positive, or a value is not finite.
  explicit Route(const std::vector<RouteWaypoint>& waypoints, const RouteOptions& options = {});

  /// Length of the whole route, all laps included.
  double length_m() const { return pieces_.back().begin_m + pieces_.back().length_m; }
  /// Lines and arcs in their order, without gaps.
  const std::vector<RoutePiece>& pieces() const { return pieces_; }
  /// Way-points as given to the constructor.
  const std::vector<RouteWaypoint>& waypoints() const { return waypoints_; }
  /// Options as given to the constructor.
  const RouteOptions& options() const { return options_; }
  /// Pose of the vehicle in the dock; empty: the vehicle stops at the end.
  const std::optional<PlanarPose>& dock() const { return options_.dock; }
  double lap_m() const {
    return length_m() / options_.laps;
  }  ///< length of one lap; of an open route the whole length

  /// Returns the point at a distance along the route, clipped to the route.
  RoutePlace at(double along_m) const;

  /// Returns the nearest point of the route. With near_m, only points within window_m of it along
  /// the route are considered, to distinguish laps and crossings.
  RoutePlace nearest(const Eigen::Vector2d& position_m, std::optional<double> near_m = {},
                     double window_m = 0.5) const;

  /// Returns the first point from along_m on whose distance from position_m is distance_m; the end
  /// of the route if there is none.
  RoutePlace ahead(const Eigen::Vector2d& position_m, double along_m, double distance_m) const;

  /// Returns points at most step_m apart, from begin to end.
  std::vector<RoutePlace> sampled(double step_m) const;

 private:
  std::vector<RoutePiece> pieces_;
  std::vector<RouteWaypoint> waypoints_;
  RouteOptions options_;
};

/// Section of a route where the vehicle would touch a wall or box.
struct RouteConflict {
  double from_m = 0, to_m = 0;                           ///< along the route
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< position with the smallest clearance
  double clearance_m = 0;                                ///< smallest clearance; negative: inside
  std::string what;                                      ///< "a wall", "boxes[2]"
};

/// Returns the clearance between a disc and the nearest wall or box that is no higher than height_m
/// above the floor; infinite if there is none. `what` may be null.
LIBOCC_API double clearance_m(const Scene& scene, const Eigen::Vector2d& position_m,
                              double radius_m, double height_m, std::string* what = nullptr);

/// Returns the conflicts of a route and its dock, sorted by from_m. Boxes whose lower side is above
/// height_m are ignored. Throws std::invalid_argument for values out of range.
LIBOCC_API std::vector<RouteConflict> route_conflicts(const Route& route, const Scene& scene,
                                                      double radius_m, double height_m);

/// Throws std::invalid_argument naming the first conflict, if there is one.
LIBOCC_API void require_free(const Route& route, const Scene& scene, double radius_m,
                             double height_m);

}  // namespace occ
