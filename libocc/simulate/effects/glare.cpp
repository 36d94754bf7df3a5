// SPDX-License-Identifier: Apache-2.0
// Veiling glare: a part of the light that lamps in view bring to the sensor reaches every pixel
// evenly, on top of their images. Left out, every pixel lacks it.
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.lens.veiling_glare > 0; }

Bound bound(const View& view) {
  const Camera& camera = view.scene.camera;
  double electrons = 0;
  for (const LampView& seen : view.lamps) electrons += seen.electrons;
  // The lamp's size over its distance, squared: what the electrons of a point lack.
  constexpr double more = 1.1;
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  return {view.grey_levels(more * view.scene.lens.veiling_glare * electrons / pixels), 0};
}

}  // namespace

const EffectModel glare_model{"lens.veiling_glare", called_for, bound};

}  // namespace occ
