// SPDX-License-Identifier: Apache-2.0
// Combines bounds over lamps, ghosts and effects. Several lamps may reach one pixel, so their
// changes add up.
#pragma once

#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/motion.hpp"

namespace occ::internal::simulate {

/// Adds the bounds of lamps whose images overlap, each enlarged by its blur and its own bound in
/// pixels. `bound_of` returns the bound of one lamp in electrons (`dn`) and pixels.
Bound sum_of_overlapping(const SceneView& view,
                         Bound (*bound_of)(const LampView& seen, const SceneView& view));

/// Adds the effect's bound in grey levels for the image of each ghost. Defined in
/// effects/ghosts.cpp.
void add_ghost_bounds(const EffectModel& model, const SceneView& view, Bound& bound);

/// Upper limit of the charge that overflow adds to a pixel, independent of the effects left out.
/// The bound of an effect that acts before the overflow increases by this amount. Defined in
/// effects/blooming.cpp.
Bound max_spill(const SceneView& view);

/// Upper limit of a pixel's electrons by direct light of the lamps.
double max_lamp_electrons(const SceneView& view);

/// Upper limit of a pixel's electrons by light of the room's surfaces, interreflection included;
/// 0 when `walls` is off or not called for.
double max_wall_electrons(const SceneView& view);

/// Upper limit of a pixel's electrons by all light other than direct light of the lamps, for the
/// effects that are called for and not off.
double background_electrons(const SceneView& view);

/// Electrons of a pixel that sees a room surface with `factor` times the largest direct irradiance.
double surface_electrons(const SceneView& view, double factor);

/// Lamps of the scene that are not in the view and therefore not in its image.
std::vector<const Lamp*> unseen_lamps(const SceneView& view);

/// True if a lamp is in the image from the pose, as a point or with its rim.
bool is_seen_from(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                  const SceneView& view, bool as_point);

/// True if a lamp that is not in the view is in an image from some pose of the motion.
bool any_comes_into_view(const SceneView& view, const Motion& motion);

}  // namespace occ::internal::simulate
