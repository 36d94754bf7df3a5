// SPDX-License-Identifier: Apache-2.0
// One bound for a whole view: a pixel that several lamps reach changes by what each of them does.
#pragma once

#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/motion.hpp"

namespace occ::internal::simulate {

/// `bound_of` gives a lamp's bounds in electrons (`dn`) and pixels. The electrons of lamps whose
/// images, their blur and what they move by included, overlap with one lamp's are added.
Bound sum_of_overlapping(const SceneView& view,
                         Bound (*bound_of)(const LampView& seen, const SceneView& view));

/// No pixel gets more light straight from lamps [electrons].
double brightest_electrons(const SceneView& view);

/// Lamps of the scene that the view does not hold: they would not be in its image.
std::vector<const Lamp*> unseen_lamps(const SceneView& view);

/// Whether a lamp would be in an image from the pose, as a point or with its rim.
bool is_seen_from(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                  const SceneView& view, bool as_point);

/// Whether a lamp that the view does not hold would be in an image from some pose of the motion.
bool any_comes_into_view(const SceneView& view, const Motion& motion);

}  // namespace occ::internal::simulate
