// SPDX-License-Identifier: Apache-2.0
// The shortest route on which the lamps stay in view. Poses are those of a lattice, eight headings
// at each of its places; a vehicle goes one place on, or round an eighth of a circle of
// `corner_radius_m` into the next heading, and along each such piece its view is looked at. What is
// planned is exactly a Route of lines and rounded corners. Search: A* (Hart, Nilsson, Raphael, "A
// formal basis for the heuristic determination of minimum cost paths", 1968); lattices of motions:
// Pivtoraiko, Knepper, Kelly, "Differentially constrained mobile robot motion planning in state
// lattices", Journal of Field Robotics 26, 2009.
//
// Walls and boxes are never touched. A place without view is passed only when there is no other
// way, by as little as can be: then the plan is none, and its gaps are where none exists.
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

enum class PlanStatus {
  ok,
  blind,          ///< every way leads through places without view; `gaps` says which
  blocked,        ///< no way at all: walls and boxes
  start_blocked,  ///< the start touches something
  goal_blocked,   ///< a goal does
};

/// The enumerator's name.
LIBOCC_API const char* to_string(PlanStatus status);

/// Places along a route from which too little is seen.
struct ViewGap {
  double from_m = 0, to_m = 0;
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();
};

struct PlanGoal {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< met to 0.71 of a cell
  std::optional<double> heading_rad;                     ///< met to an eighth of a turn
};

struct LIBOCC_API RoutePlanOptions {
  VisibilityOptions view;
  int min_lamps = 1;                                             ///< in view everywhere
  double max_sigma_m = std::numeric_limits<double>::infinity();  ///< Visibility::position_sigma_m
  double cell_m = 0.1;
  double corner_radius_m = 0.3;
  double vehicle_radius_m = 0.3, vehicle_height_m = 0.5;
  double speed_m_s = 0.5;     ///< of the route
  double turn_cost_m = 0.02;  ///< a corner counts as so much more way

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct RoutePlan {
  PlanStatus status = PlanStatus::blocked;
  std::string message;         ///< where and why there is none; empty when ok
  std::optional<Route> route;  ///< ok and blind
  std::vector<RouteWaypoint> waypoints;
  std::vector<ViewGap> gaps;
  double seen_share = 0;  ///< of the route's length
};

/// The start's heading is rounded to an eighth of a turn. Throws std::invalid_argument when scene
/// or options do not validate, there is no goal, or a place is not finite.
LIBOCC_API RoutePlan plan_route(const Scene& scene, const PlanarPose& start,
                                const std::vector<PlanGoal>& goals,
                                const RoutePlanOptions& options = {});

/// Where along a given route too little is seen, looked at every step_m.
LIBOCC_API std::vector<ViewGap> view_gaps(const Scene& scene, const Route& route,
                                          const RoutePlanOptions& options, double step_m = 0.02);

}  // namespace occ
