// SPDX-License-Identifier: Apache-2.0
// Saturation: a pixel holds no more charge than its full well. Without the effect, grey levels are
// only clipped at full scale. Nothing changes unless the electrons of a pixel exceed the full well,
// overlapping images of lamps included. The centroid of a clipped image moves by at most the
// fraction of the light that is lost, times the radius.
#include <algorithm>

#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
namespace saturation_effect {
namespace {

bool called_for(const Scene&, const SimulateOptions&) { return true; }

Bound bound(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  const double max_e = sensor.electrons(0) + background_electrons(view) + max_lamp_electrons(view);
  double radius = 0;
  for (const LampView& seen : view.lamps) radius = std::max(radius, seen.radius_px);
  const double lost = max_e - sensor.full_well_e;
  if (!(lost > 0)) return {};
  double white = 0;  // grey levels from the full well to full scale
  for (std::size_t place = 0; place < 4; ++place)
    white = std::max(
        white, sensor.full_scale_dn() - sensor_at(sensor, place).grey_level(sensor.full_well_e));
  const double change = std::min(view.grey_levels(lost), white);
  return {change, change > 0 ? radius * std::min(1.0, lost / sensor.full_well_e) : 0};
}

void remove(Sensor& sensor) { sensor.full_well_e = 1e30; }

}  // namespace
}  // namespace saturation_effect

const EffectModel saturation_model = [] {
  EffectModel model{Effect::saturation, Stage::charge, saturation_effect::called_for,
                    "every sensor has a full well", saturation_effect::bound};
  model.remove = saturation_effect::remove;
  return model;
}();

}  // namespace occ::internal::simulate
