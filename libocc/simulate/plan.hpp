// SPDX-License-Identifier: Apache-2.0
// Plans an image of a scene: the effects it will contain, and bounds on the change by the effects
// that are left out.
//
// An effect is called for if the scene has a setting that causes it (a PSF width, boxes, a
// waveform). With `Use::automatic` it is left out if both of its bounds are within the scene's
// tolerances: the largest change of a pixel of the noise-free image [grey levels], and the largest
// displacement of a lamp's centroid [px]. Bounds are closed forms, derived in simulate/effects/,
// not renderings.
#pragma once

#include <array>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ {

/// Decision on one effect.
struct EffectPlan {
  Effect effect = Effect::extent;  ///< effect that the decision concerns
  Use use = Use::on;               ///< as in Scene::effects
  bool called_for = false;         ///< the scene has a setting that causes it
  bool applied = false;            ///< the image contains it
  /// Largest change of the image when it is left out; 0 if it is not called for.
  double bound_dn = 0, bound_px = 0;
  std::string reason;  ///< why it is applied or not, as text
};

/// Decisions on all effects of one image.
struct LIBOCC_API RenderPlan {
  std::array<EffectPlan, effect_count> effects;  ///< index: the value of Effect

  /// True if the image contains the effect.
  bool applies(Effect effect) const { return effects[static_cast<std::size_t>(effect)].applied; }
};

/// The plan that simulate() follows for one image, with all bounds. Throws std::invalid_argument if
/// the scene, the pose or the options do not validate, if effects contradict each other, or if the
/// camera is at a position that simulate() rejects.
LIBOCC_API RenderPlan plan_render(const Scene& scene, const Rigid3& cam_from_world,
                                  const SimulateOptions& options = {});

}  // namespace occ
