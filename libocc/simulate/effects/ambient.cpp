// SPDX-License-Identifier: Apache-2.0
// Light that comes from no lamp, the same on every pixel. Left out, every pixel lacks it; where the
// lamps' own light is does not change.
#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ::internal::simulate {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.ambient_w_m2 > 0; }

Bound bound(const SceneView& view) { return {view.grey_levels(ambient_electrons(view)), 0}; }

}  // namespace

const EffectModel ambient_model{"ambient_w_m2", called_for, bound};

}  // namespace occ::internal::simulate
