// SPDX-License-Identifier: Apache-2.0
// Ambient light: light that comes from no lamp, the same on every pixel. Without the effect it is
// missing from every pixel; no lamp's image moves.
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
namespace ambient_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) { return scene.ambient_w_m2 > 0; }

double background_e(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  return max_pixel_factor(view.scene, Eigen::Vector3d::Ones()) *
         (sensor.electrons(view.scene.ambient_w_m2) - sensor.electrons(0));
}

Bound bound(const SceneView& view) { return {view.grey_levels(background_e(view)), 0}; }

void render(const Frame& frame, const ByPlace&, Signal& signal) {
  const Sensor& sensor = frame.scene.sensor;
  const double ambient = sensor.electrons(frame.scene.ambient_w_m2) - sensor.electrons(0);
  ByPlace electrons = light_by_place(frame, Eigen::Vector3d::Ones());
  for (double& value : electrons) value *= ambient;
  signal.add_everywhere(electrons);
}

}  // namespace
}  // namespace ambient_effect

const EffectModel ambient_model = [] {
  EffectModel model{Effect::ambient, Stage::charge, ambient_effect::called_for, "ambient_w_m2 is 0",
                    ambient_effect::bound};
  model.background_e = ambient_effect::background_e;
  model.render = ambient_effect::render;
  return model;
}();

}  // namespace occ::internal::simulate
