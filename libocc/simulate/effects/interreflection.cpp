// SPDX-License-Identifier: Apache-2.0
// The room's surfaces light each other. In a closed room each further reflection has at most rho
// times the light of the one before, so that all of them together add to the irradiance at most
// rho / (1 - rho) of the largest by the lamps.
#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ::internal::simulate {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.room && scene.room->wall_reflectance > 0;
}

Bound bound(const SceneView& view) { return {view.grey_levels(interreflected_electrons(view)), 0}; }

}  // namespace

const EffectModel interreflection_model{"room.wall_reflectance", called_for, bound};

}  // namespace occ::internal::simulate
