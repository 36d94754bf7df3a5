// SPDX-License-Identifier: Apache-2.0
// How a camera that pans and tilts keeps the lamps in view along a given route: the angles of least
// cost by dynamic programming (Bellman, Dynamic Programming, 1957) over places along the route and
// a grid of angles. A place costs its bound of position (guide/visibility.hpp), one without enough
// lamps far more, and each turn its angle; turns faster than the axes are not possible.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"
#include "libocc/guide/pan_tilt_plan.hpp"
#include "libocc/guide/plan_route.hpp"
#include "libocc/guide/route.hpp"

namespace occ {

struct LIBOCC_API PanTiltOptions {
  VisibilityOptions view;  ///< its pan and tilt are not looked at
  int min_lamps = 1;       ///< in view everywhere
  double min_pan_rad = -pi, max_pan_rad = pi;
  double min_tilt_rad = 0, max_tilt_rad = 0.8;
  int pans = 25, tilts = 9;  ///< of the grid, both ends included; 1: the axis stays at its least
  double pan_rate_rad_s = 1, tilt_rate_rad_s = 1;
  double step_m = 0.2;          ///< between the plan's knots, at most
  double sigma_cost_1_m = 100;  ///< a bound of 1 cm at a place counts as much as a turn by 1 rad

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct PanTiltResult {
  PlanStatus status = PlanStatus::blind;  ///< ok or blind
  std::string message;                    ///< where there is no plan; empty when ok
  PanTiltPlan plan;                       ///< the least blind one
  std::vector<ViewGap> gaps;              ///< looked at finely, between the knots, too
  double seen_share = 0;                  ///< of the route's length
};

/// Throws std::invalid_argument when scene or options do not validate, or the grid is too coarse
/// for the axes to get from one of its angles to the next between two knots.
LIBOCC_API PanTiltResult plan_pan_tilt(const Scene& scene, const Route& route,
                                       const PanTiltOptions& options = {});

}  // namespace occ
