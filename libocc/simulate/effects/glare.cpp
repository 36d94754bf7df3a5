// SPDX-License-Identifier: Apache-2.0
// Veiling glare: a part of the light that lamps in view bring to the sensor reaches every pixel
// evenly, on top of their images. Left out, every pixel lacks it.
#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ::internal::simulate {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.lens.veiling_glare > 0; }

Bound bound(const SceneView& view) { return {view.grey_levels(glare_electrons(view)), 0}; }

}  // namespace

const EffectModel glare_model{"lens.veiling_glare", called_for, bound};

}  // namespace occ::internal::simulate
