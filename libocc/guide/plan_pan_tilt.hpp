// SPDX-License-Identifier: Apache-2.0
// Plans pan and tilt angles that keep the lamps in view along a given route.
//
// Dynamic programming (Bellman, Dynamic Programming, 1957) over positions along the route and a
// grid of angles. The cost of a position is its bound of the position error (guide/visibility.hpp),
// or much more without enough lamps in view; the cost of a rotation is its angle. Rotations faster
// than the axes are excluded.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"
#include "libocc/guide/pan_tilt_plan.hpp"
#include "libocc/guide/plan_route.hpp"
#include "libocc/guide/route.hpp"

namespace occ {

/// Options of plan_pan_tilt().
struct LIBOCC_API PanTiltOptions {
  VisibilityOptions view;                       ///< its pan and tilt are ignored
  int min_lamps = 1;                            ///< minimum number of lamps in view everywhere
  double min_pan_rad = -pi, max_pan_rad = pi;   ///< range of the pan axis
  double min_tilt_rad = 0, max_tilt_rad = 0.8;  ///< range of the tilt axis
  int pans = 25, tilts = 9;  ///< grid points, both ends included; 1: the axis stays at its minimum
  double pan_rate_rad_s = 1, tilt_rate_rad_s = 1;  ///< maximum rates at the route's speed
  double step_m = 0.2;                             ///< maximum distance between the plan's knots
  double sigma_cost_1_m =
      100;  ///< cost of a bound: by default 1 cm at one position counts like a rotation by 1 rad

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Planned angles, with the sections that remain without view.
struct PanTiltResult {
  PlanStatus status = PlanStatus::blind;  ///< ok or blind
  std::string message;                    ///< description of the gaps; empty if ok
  PanTiltPlan plan;                       ///< best plan, also if it has gaps
  std::vector<ViewGap> gaps;              ///< checked between the knots, too
  double seen_share = 0;                  ///< share of the route's length with enough lamps in view
};

/// Throws std::invalid_argument if the scene or the options are invalid, or the grid is too coarse
/// for the axes to move between neighbouring angles within one step.
LIBOCC_API PanTiltResult plan_pan_tilt(const Scene& scene, const Route& route,
                                       const PanTiltOptions& options = {});

}  // namespace occ
