// SPDX-License-Identifier: Apache-2.0
// Veiling glare: a fraction of the light that lamps in view bring to the sensor reaches all pixels
// evenly, in addition to the lamps' images. Without the effect, every pixel lacks it; no lamp's
// image moves.
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/frame.hpp"

namespace occ::internal::simulate {
namespace glare_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.lens.veiling_glare > 0; }

double background_e(const SceneView& view) {
  const Camera& camera = view.scene.camera;
  double electrons = 0;
  for (const LampView& seen : view.lamps) electrons += seen.electrons;
  // LampView::electrons is that of a point lamp, too small by the square of size over distance.
  constexpr double margin = 1.1;
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  return margin * view.scene.lens.veiling_glare * electrons / pixels;
}

Bound bound(const SceneView& view) { return {view.grey_levels(background_e(view)), 0}; }

void render(const Frame& frame, const ByPlace& lamp_electrons, Signal& signal) {
  const double pixels = static_cast<double>(signal.width()) * signal.height();
  ByPlace electrons{};
  for (std::size_t place = 0; place < electrons.size(); ++place)
    electrons[place] = frame.scene.lens.veiling_glare * lamp_electrons[place] / pixels;
  signal.add_everywhere(electrons);
}

}  // namespace
}  // namespace glare_effect

const EffectModel glare_model = [] {
  EffectModel model{Effect::glare, Stage::charge, glare_effect::called_for,
                    "lens.veiling_glare is 0", glare_effect::bound};
  model.background_e = glare_effect::background_e;
  model.render = glare_effect::render;
  return model;
}();

}  // namespace occ::internal::simulate
