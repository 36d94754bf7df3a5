// SPDX-License-Identifier: Apache-2.0
// Reports for each effect of the simulation how much it changes an image of a scene and how long it
// takes, as a basis for choosing the effects to render.
#pragma once

#include <array>

#include "libocc/core/abi.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ {

/// Plan of one effect, with its influence on the position and its cost.
struct ExplainedEffect : EffectPlan {
  /// Largest displacement of a position solved from the lamps' centroids when the effect is left
  /// out [m]: bound_px times the sum over all lamps in view of the largest singular value of
  /// d position / d centroid (unweighted least squares). Infinite if the lamps in view do not
  /// determine the pose.
  double position_bound_m = 0;
  /// Time that the effect adds to the rendering of one image of many, or would add if it is left
  /// out [s]. The difference of two measured times, with their noise; 0 if it is not called for.
  double cost_s = 0;
};

/// Plan of an image with bounds and times.
struct Explanation {
  std::array<ExplainedEffect, effect_count> effects;  ///< index: the value of Effect
  double render_s = 0;  ///< time of one image as planned [s]; 0 if not measured
};

/// Extends plan_render() by the bounds on the position and by times. Times are medians of
/// `repetitions` images by one Renderer, with and without each effect; they are not measured if it
/// is 0. Throws std::invalid_argument as plan_render() does, and if `repetitions` is negative.
LIBOCC_API Explanation explain(const Scene& scene, const Rigid3& cam_from_world,
                               const SimulateOptions& options = {}, int repetitions = 9);

}  // namespace occ
