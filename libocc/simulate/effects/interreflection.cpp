// SPDX-License-Identifier: Apache-2.0
// Interreflection: the room's surfaces light each other. In a closed room of reflectance rho, each
// further reflection has at most rho times the light of the one before. All of them together add at
// most rho / (1 - rho) of the largest irradiance by the lamps. The light itself is computed by
// radiosity (internal/room_surfaces.hpp) and rendered with the walls.
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace interreflection_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.room && scene.room->wall_reflectance > 0;
}

double background_e(const SceneView& view) {
  const double reflectance = view.scene.room->wall_reflectance;
  return surface_electrons(view, reflectance / (1 - reflectance));
}

Bound bound(const SceneView& view) { return {view.grey_levels(background_e(view)), 0}; }

}  // namespace
}  // namespace interreflection_effect

const EffectModel interreflection_model = [] {
  EffectModel model{Effect::interreflection, Stage::charge, interreflection_effect::called_for,
                    "there is no room, or room.wall_reflectance is 0",
                    interreflection_effect::bound};
  model.required = Effect::walls;
  model.background_e = interreflection_effect::background_e;
  return model;
}();

}  // namespace occ::internal::simulate
