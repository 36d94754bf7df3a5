// SPDX-License-Identifier: Apache-2.0
// Grey levels are no linear function of the light; under a mosaic each colour may have a curve of
// its own. Left out, they are: a pixel changes by the largest distance of a curve from its chord,
// and centroids of grey levels may move by as much of a lamp's radius.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
namespace {

/// The curves that pixels are stored by.
std::vector<Sensor> curves(const Sensor& sensor) {
  std::vector<Sensor> all;
  for (std::size_t place = 0; place < 4; ++place) all.push_back(sensor_at(sensor, place));
  all.push_back(sensor);  // where the mosaic is left out
  return all;
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  for (const Channel& channel : scene.sensor.channels)
    if (channel.response != Response::linear) return true;
  return scene.sensor.response != Response::linear;
}

Bound bound(const SceneView& view) {
  constexpr int samples = 1024;
  const Sensor& sensor = view.scene.sensor;
  Sensor straight = sensor;
  straight.response = Response::linear;
  double change = 0, radius = 0;
  for (const Sensor& curved : curves(sensor))
    for (int i = 0; i <= samples; ++i) {
      const double electrons = sensor.full_well_e * i / samples;
      change =
          std::max(change, std::abs(curved.grey_level(electrons) - straight.grey_level(electrons)));
    }
  for (const LampView& seen : view.lamps) radius = std::max(radius, seen.radius_px);
  return {change, radius * std::min(1.0, change / sensor.full_scale_dn())};
}

}  // namespace

const EffectModel response_model{"sensor.response", called_for, bound};

}  // namespace occ::internal::simulate
