// SPDX-License-Identifier: Apache-2.0
// Light that does not come straight from a lamp, as bounds need it: no pixel gets more [electrons].
#pragma once

#include "libocc/simulate/internal/view.hpp"

namespace occ::internal::simulate {

double ambient_electrons(const SceneView& view);

/// From the room's surfaces as the lamps light them; and, from these as they light each other.
double wall_electrons(const SceneView& view);
double interreflected_electrons(const SceneView& view);

/// Both, where the scene has them.
double lit_wall_electrons(const SceneView& view);

double glare_electrons(const SceneView& view);
double ghost_electrons(const SceneView& view);

/// All of it, of effects that are called for and not switched off.
double background_electrons(const SceneView& view);

}  // namespace occ::internal::simulate
