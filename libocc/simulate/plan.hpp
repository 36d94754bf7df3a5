// SPDX-License-Identifier: Apache-2.0
// Which effects an image of a scene will contain, and what the others would have changed.
//
// An effect is called for when the scene says something that it follows from. With `Use::automatic`
// it is left out when both its bounds are within the scene's tolerances: how much any pixel of the
// noise-free image would change [grey levels], and how far any lamp's centroid would move [px].
// Bounds come from closed forms (simulate/effects/, each with its derivation), not from rendering.
#pragma once

#include <array>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ {

struct EffectPlan {
  Effect effect = Effect::extent;
  Use use = Use::on;
  bool called_for = false;
  bool applied = false;
  /// What rendering without it would change at most; zero when it is not called for.
  double bound_dn = 0, bound_px = 0;
  std::string reason;  ///< for people: why it is applied or not
};

struct LIBOCC_API RenderPlan {
  std::array<EffectPlan, effect_count> effects;  ///< in the order of Effect

  bool applies(Effect effect) const { return effects[static_cast<std::size_t>(effect)].applied; }
};

/// The plan that simulate() follows for one image, with all bounds worked out. Throws
/// std::invalid_argument when the scene, the pose or the options do not validate, effects
/// contradict each other, or the camera is where simulate() would refuse it.
LIBOCC_API RenderPlan plan_render(const Scene& scene, const Rigid3& cam_from_world,
                                  const SimulateOptions& options = {});

}  // namespace occ
