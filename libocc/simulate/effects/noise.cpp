// SPDX-License-Identifier: Apache-2.0
// Noise: shot noise, noise of the dark current, read noise. Without the effect, a pixel has its
// mean. The bounds are one standard deviation of the brightest pixel's grey level and of a lamp's
// centroid, the largest over all lamps: sqrt(sum of (x - x_c)^2 var) / F over the disc of the
// lamp's image and its blur, with F the lamp's electrons. Rendered by internal/expose.hpp.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace noise_effect {
namespace {

bool called_for(const Scene&, const SimulateOptions& options) { return options.noise; }

Bound bound(const SceneView& view) {
  constexpr double blur_sigmas = 2;
  const Sensor& sensor = view.scene.sensor;
  const double floor_e2 = sensor.read_noise_e * sensor.read_noise_e + sensor.electrons(0);
  Bound bound{sensor.gain_dn_per_e * std::sqrt(floor_e2), 0};
  for (const LampView& seen : view.lamps) {
    const double shot_e2 = std::min(seen.peak_e, sensor.full_well_e);
    const double radius = seen.radius_px + blur_sigmas * sensor.psf_sigma_px + 0.5;
    // The second moment of a disc about its centre along one axis is pi r^4 / 4.
    const double floor_moment = floor_e2 * pi * std::pow(radius, 4) / 4;
    const double shot_moment = seen.electrons * radius * radius / 4;
    bound.include({sensor.gain_dn_per_e * std::sqrt(floor_e2 + shot_e2),
                   std::sqrt(2 * (floor_moment + shot_moment)) / seen.electrons});
  }
  return bound;
}

}  // namespace
}  // namespace noise_effect

const EffectModel noise_model{Effect::noise, Stage::output, noise_effect::called_for,
                              "the option noise is off", noise_effect::bound};

}  // namespace occ::internal::simulate
