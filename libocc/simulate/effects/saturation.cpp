// SPDX-License-Identifier: Apache-2.0
// A full well holds no more. Left out, grey levels are clipped at full scale alone: nothing changes
// unless a pixel's electrons exceed the full well, lamps' images that overlap included. The
// centroid of a clipped image has moved by no more than the light that is lost, at its radius.
#include <algorithm>

#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/overlap.hpp"

namespace occ::internal::simulate {
namespace {

bool called_for(const Scene&, const SimulateOptions&) { return true; }

Bound bound(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  const double most = sensor.electrons(0) + background_electrons(view) + brightest_electrons(view);
  double radius = 0;
  for (const LampView& seen : view.lamps) radius = std::max(radius, seen.radius_px);
  const double lost = most - sensor.full_well_e;
  if (!(lost > 0)) return {};
  double white = 0;  // grey levels that the full well leaves to full scale
  for (std::size_t place = 0; place < 4; ++place)
    white = std::max(
        white, sensor.full_scale_dn() - sensor_at(sensor, place).grey_level(sensor.full_well_e));
  const double change = std::min(view.grey_levels(lost), white);
  return {change, change > 0 ? radius * std::min(1.0, lost / sensor.full_well_e) : 0};
}

}  // namespace

const EffectModel saturation_model{"sensor.full_well_e", called_for, bound};

}  // namespace occ::internal::simulate
