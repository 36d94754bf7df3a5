// SPDX-License-Identifier: Apache-2.0
// Mosaic of colour filters: a pixel receives the lamp's colour times the efficiency of its channel,
// a factor f that depends on its place. Without the effect, every pixel receives white light: a
// pixel changes by |f - 1| and by the difference of the channels' curves.
//
// Centroids move because the mosaic samples the image. f is its mean plus waves of half a cycle per
// pixel, each of relative amplitude a. A wave moves the centroid by a |d/dw W|, with W the Fourier
// transform of the image, at w = pi. For a convex shape under a Gaussian of variance s^2 that is at
// most (4/pi + pi s^2) exp(-pi^2 s^2 / 2).
#include "libocc/simulate/internal/mosaic.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/normal_variate.hpp"

namespace occ::internal::simulate {

using namespace internal::radiometry;
namespace mosaic_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.sensor.mosaic != Mosaic::none;
}

// Sum of the amplitudes of the waves, relative to the mean.
double contrast(const ByPlace& f) {
  const double mean = f[0] + f[1] + f[2] + f[3];
  return (std::abs(f[0] - f[1] + f[2] - f[3]) + std::abs(f[0] + f[1] - f[2] - f[3]) +
          std::abs(f[0] - f[1] - f[2] + f[3])) /
         mean;
}

// Largest difference between a channel's response curve and the sensor's [grey levels].
double curve_change(const Sensor& sensor) {
  constexpr int samples = 256;
  double change = 0;
  for (std::size_t place = 0; place < 4; ++place) {
    const Sensor other = sensor_at(sensor, place);
    for (int i = 0; i <= samples; ++i) {
      const double electrons = sensor.full_well_e * i / samples;
      change =
          std::max(change, std::abs(sensor.grey_level(electrons) - other.grey_level(electrons)));
    }
  }
  return change;
}

Bound bound(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  const double curves = sensor.channels.empty() ? 0 : curve_change(sensor);
  double sum_e = 0;
  Bound bound{curves, 0};
  const double variance = std::pow(sensor.psf_sigma_px, 2);
  const double wave = (4 / pi + pi * variance) * std::exp(-0.5 * pi * pi * variance);
  for (const LampView& seen : view.lamps) {
    const ByPlace factors = light_by_place(sensor, seen.lamp->colour);
    double change = 0;
    for (const double f : factors) change = std::max(change, std::abs(f - 1));
    sum_e += change * seen.peak_e / max_pixel_factor(view.scene, seen.lamp->colour);
    // Curves that differ give the same light different weights in a centroid.
    const double stored = curves > 0 ? seen.radius_px : 0;
    bound.include({0, contrast(factors) * wave + stored});
  }
  bound.dn += view.grey_levels(sum_e + background_electrons(view));
  return bound;
}

void remove(Sensor& sensor) { sensor.mosaic = Mosaic::none; }

}  // namespace
}  // namespace mosaic_effect

ByPlace light_by_place(const Sensor& sensor, const Eigen::Vector3d& colour) {
  ByPlace light{1, 1, 1, 1};
  if (sensor.mosaic == Mosaic::none) return light;
  for (std::size_t place = 0; place < light.size(); ++place) {
    const std::size_t channel = colour_at(sensor.mosaic, place);
    light[place] = colour[static_cast<Eigen::Index>(channel)] *
                   (sensor.channels.empty() ? 1 : sensor.channels[channel].efficiency);
  }
  return light;
}

Sensor sensor_at(const Sensor& sensor, std::size_t place) {
  Sensor here = sensor;
  if (sensor.mosaic == Mosaic::none || sensor.channels.empty()) return here;
  const Channel& channel = sensor.channels[colour_at(sensor.mosaic, place)];
  here.response = channel.response;
  here.gamma = channel.gamma;
  here.response_table = channel.response_table;
  return here;
}

ByPlace light_by_place(const Frame& frame, const Eigen::Vector3d& colour) {
  if (!frame.plan.applies(Effect::mosaic)) return {1, 1, 1, 1};
  return light_by_place(frame.scene.sensor, colour);
}

double max_pixel_factor(const Scene& scene, const Eigen::Vector3d& colour) {
  double factor = 1;
  for (const double light : light_by_place(scene.sensor, colour)) factor = std::max(factor, light);
  return factor * (1 + max_normal_variate * scene.sensor.gain_sigma);
}

const EffectModel mosaic_model = [] {
  EffectModel model{Effect::mosaic, Stage::charge, mosaic_effect::called_for,
                    "sensor.mosaic is none", mosaic_effect::bound};
  model.remove = mosaic_effect::remove;
  return model;
}();

}  // namespace occ::internal::simulate
