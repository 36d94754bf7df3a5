// SPDX-License-Identifier: Apache-2.0
// Plans the shortest route on which the lamps stay in view.
//
// Poses form a lattice with eight headings at each position. A motion goes straight to the next
// position, or along an eighth of a circle of `corner_radius_m` to the next heading; the view is
// checked along each motion. The result is a Route of lines and rounded corners. Search: A* (Hart,
// Nilsson, Raphael, "A formal basis for the heuristic determination of minimum cost paths", 1968);
// lattices of motions: Pivtoraiko, Knepper, Kelly, "Differentially constrained mobile robot motion
// planning in state lattices", Journal of Field Robotics 26, 2009.
//
// Routes never touch walls or boxes. Positions without view are used only if every route contains
// some, and then as few as possible; the status is then `blind`, and `gaps` lists them.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/guide/route.hpp"
#include "libocc/guide/visibility.hpp"

namespace occ {

/// Outcome of planning.
enum class PlanStatus {
  ok,             ///< lamps are in view everywhere
  blind,          ///< every route has positions without view; see `gaps`
  blocked,        ///< no route because of walls and boxes
  start_blocked,  ///< the start touches a wall or box
  goal_blocked,   ///< a goal touches a wall or box
};

/// The enumerator's name.
LIBOCC_API const char* to_string(PlanStatus status);

/// Section of a route without sufficient view.
struct ViewGap {
  double from_m = 0, to_m = 0;  ///< distances along the route
  /// Positions of both ends in the world [m].
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
};

/// A position to pass, with a heading if it matters.
struct PlanGoal {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< reached within 0.71 of a cell
  std::optional<double> heading_rad;                     ///< reached within 22.5 degrees
};

/// Options of plan_route().
struct LIBOCC_API RoutePlanOptions {
  VisibilityOptions view;  ///< camera and accuracy of the images
  int min_lamps = 1;       ///< minimum number of lamps in view everywhere
  double max_sigma_m =
      std::numeric_limits<double>::infinity();  ///< limit of Visibility::position_sigma_m
  double cell_m = 0.1;                          ///< spacing of the lattice's positions
  double corner_radius_m = 0.3;                 ///< radius of rounded corners
  /// Disc that contains the vehicle; higher boxes do not block.
  double vehicle_radius_m = 0.3, vehicle_height_m = 0.5;
  double speed_m_s = 0.5;     ///< speed of the route
  double turn_cost_m = 0.02;  ///< cost of a corner, as additional length

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Planned route, or the reason why there is none.
struct RoutePlan {
  PlanStatus status = PlanStatus::blocked;  ///< ok or blind: `route` is set
  std::string message;                      ///< description of the problem; empty if ok
  std::optional<Route> route;               ///< set for ok and blind
  std::vector<RouteWaypoint> waypoints;     ///< corners of the route
  std::vector<ViewGap> gaps;                ///< sections without view; empty if ok
  double seen_share = 0;                    ///< share of the route's length with sufficient view
};

/// The start's heading is rounded to a multiple of 45 degrees. Throws std::invalid_argument if the
/// scene or the options are invalid, there is no goal, or a position is not finite.
LIBOCC_API RoutePlan plan_route(const Scene& scene, const PlanarPose& start,
                                const std::vector<PlanGoal>& goals,
                                const RoutePlanOptions& options = {});

/// Returns the sections of a given route without sufficient view, checked every step_m.
LIBOCC_API std::vector<ViewGap> view_gaps(const Scene& scene, const Route& route,
                                          const RoutePlanOptions& options, double step_m = 0.02);

}  // namespace occ
