// SPDX-License-Identifier: Apache-2.0
// The room's surfaces reflect the lamps' light, once. A diffuse surface of irradiance E has the
// radiance rho E / pi, and a pixel that sees it gets at most pi / 4N^2 of that (less by cos^4 off
// the axis). Left out, surfaces are dark, so that they do not light each other either; the lamps'
// own light does not change.
#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ::internal::simulate {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.room && scene.room->wall_reflectance > 0;
}

Bound bound(const SceneView& view) { return {view.grey_levels(lit_wall_electrons(view)), 0}; }

}  // namespace

const EffectModel walls_model{"room.wall_reflectance", called_for, bound};

}  // namespace occ::internal::simulate
