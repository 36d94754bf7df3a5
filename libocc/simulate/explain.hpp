// SPDX-License-Identifier: Apache-2.0
// What every effect does to an image of a scene, and what it costs: for people who decide what to
// simulate, and who want to know what was left out.
#pragma once

#include <array>

#include "libocc/core/abi.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ {

struct ExplainedEffect : EffectPlan {
  /// How far a position solved from the lamps' centroids moves at most without the effect [m]:
  /// bound_px times the sum over lamps in view of the largest gain of the unweighted least-squares
  /// position by a lamp's centroid. Infinite where the lamps in view determine no pose.
  double position_bound_m = 0;
  /// Time that the effect takes of rendering one image of many; of one that is left out, would
  /// take [s]. Zero when it is not called for; a difference of two measured times, so not exact.
  double cost_s = 0;
};

struct Explanation {
  std::array<ExplainedEffect, effect_count> effects;  ///< in the order of Effect
  double render_s = 0;                                ///< one image as planned
};

/// plan_render() with what follows from it. Times are medians of `repetitions` images by one
/// Renderer with and without each effect; with 0 they are not measured and zero. Throws
/// std::invalid_argument as plan_render() does, and unless repetitions >= 0.
LIBOCC_API Explanation explain(const Scene& scene, const Rigid3& cam_from_world,
                               const SimulateOptions& options = {}, int repetitions = 9);

}  // namespace occ
