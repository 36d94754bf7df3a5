// SPDX-License-Identifier: Apache-2.0
// A full well holds no more. Left out, grey levels are clipped at full scale alone: nothing changes
// unless a pixel's electrons exceed the full well, lamps' images that overlap included. The
// centroid of a clipped image has moved by no more than the light that is lost, at its radius.
#include <algorithm>

#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

bool called_for(const Scene&, const SimulateOptions&) { return true; }

Bound bound(const View& view) {
  const Sensor& sensor = view.scene.sensor;
  double most = sensor.electrons(0) + background_electrons(view), radius = 0;
  for (const LampView& seen : view.lamps) {
    most += seen.peak_e;
    radius = std::max(radius, seen.radius_px);
  }
  const double lost = most - sensor.full_well_e;
  if (!(lost > 0)) return {};
  const double white = sensor.full_scale_dn() - sensor.grey_level(sensor.full_well_e);
  const double change = std::min(sensor.gain_dn_per_e * lost, white);
  return {change, change > 0 ? radius * std::min(1.0, lost / sensor.full_well_e) : 0};
}

}  // namespace

const EffectModel saturation_model{"sensor.full_well_e", called_for, bound};

}  // namespace occ
