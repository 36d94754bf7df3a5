// SPDX-License-Identifier: Apache-2.0
// Response: grey levels are a non-linear function of the light; under a mosaic each colour may have
// its own curve. Without the effect, all curves are linear: a pixel changes by at most the largest
// distance of a curve from its chord, and centroids of grey levels move by at most that fraction of
// a lamp's radius.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
namespace response_effect {
namespace {

// Sensors with the response curves of all pixels.
std::vector<Sensor> curves(const Sensor& sensor) {
  std::vector<Sensor> all;
  for (std::size_t place = 0; place < 4; ++place) all.push_back(sensor_at(sensor, place));
  all.push_back(sensor);  // curve when the mosaic is left out
  return all;
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  for (const Channel& channel : scene.sensor.channels)
    if (channel.response != Response::linear) return true;
  return !scene.sensor.is_linear();
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
  return {change, radius * change / sensor.full_scale_dn()};
}

void remove(Sensor& sensor) {
  sensor.response = Response::linear;
  for (Channel& channel : sensor.channels) channel.response = Response::linear;
}

}  // namespace
}  // namespace response_effect

const EffectModel response_model = [] {
  EffectModel model{Effect::response, Stage::output, response_effect::called_for,
                    "sensor.response is linear", response_effect::bound};
  model.remove = response_effect::remove;
  return model;
}();

}  // namespace occ::internal::simulate
