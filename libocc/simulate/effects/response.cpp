// SPDX-License-Identifier: Apache-2.0
// Grey levels are no linear function of the light. Left out, they are: a pixel changes by the
// largest distance of the curve from its chord, and centroids of grey levels may move by as much of
// a lamp's radius.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.sensor.response != Response::linear;
}

Bound bound(const View& view) {
  constexpr int samples = 1024;
  const Sensor& curved = view.scene.sensor;
  Sensor straight = curved;
  straight.response = Response::linear;
  double change = 0, radius = 0;
  for (int i = 0; i <= samples; ++i) {
    const double electrons = curved.full_well_e * i / samples;
    change =
        std::max(change, std::abs(curved.grey_level(electrons) - straight.grey_level(electrons)));
  }
  for (const LampView& seen : view.lamps) radius = std::max(radius, seen.radius_px);
  return {change, radius * std::min(1.0, change / curved.full_scale_dn())};
}

}  // namespace

const EffectModel response_model{"sensor.response", called_for, bound};

}  // namespace occ
