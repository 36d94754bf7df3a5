// SPDX-License-Identifier: Apache-2.0
// Exposure series of a wall of lamps with increasing brightness.
#pragma once

#include <cmath>
#include <vector>

#include "libocc/formation/light.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

/// Square lamps side by side in rows of twelve in front of the camera, with a contrast of 100 to 1.
/// 240 x 160 pixels, 20 x 20 for each lamp.
inline Scene wall_of_lamps(Response response = Response::linear) {
  constexpr int columns = 12, rows = 8;
  constexpr double pitch_m = 0.2, distance_m = 10;
  Scene scene;
  scene.camera = Camera::pinhole(240, 160, 1000, 1000, 119.5, 79.5);
  for (int i = 0; i < columns * rows; ++i) {
    Lamp lamp;
    lamp.id = i;
    lamp.shape = LampShape::rectangle;
    lamp.size_m = {0.9 * pitch_m, 0.9 * pitch_m};
    lamp.normal = -Eigen::Vector3d::UnitZ();
    lamp.centre_m = {(i % columns - 5.5) * pitch_m, (i / columns - 3.5) * pitch_m, distance_m};
    const int shuffled = 37 * i % (columns * rows);
    lamp.power_w = std::pow(100, shuffled / 95.0);
    scene.lamps.push_back(lamp);
  }
  scene.sensor.response = response;
  scene.sensor.full_well_e = 20000;
  scene.sensor.gain_dn_per_e = 0.025;
  scene.sensor.black_level_dn = 0;
  return scene;
}

struct Series {
  std::vector<Image> images;
  std::vector<double> exposures_s;

  std::vector<ImageView> views() const {
    std::vector<ImageView> all;
    for (const Image& image : images) all.push_back(image.view());
    return all;
  }
};

/// Geometric series of exposure times; the longest saturates the lamp of this index (0: darkest).
inline Series exposure_series(Scene scene, int count, double factor = 2, std::uint64_t seed = 1,
                              double white_power_w = 3) {
  Sensor& sensor = scene.sensor;
  Lamp lamp = scene.lamps.front();
  lamp.power_w = white_power_w;
  const double irradiance =
      irradiance_at(lamp, {}, scene.camera, sensor, scene.camera.project(lamp.centre_m).value());
  const double white_e = sensor.full_scale_dn() / sensor.gain_dn_per_e;
  const double longest_s = sensor.exposure_s * white_e / sensor.electrons(irradiance);
  Series series;
  for (int j = 0; j < count; ++j) {
    sensor.exposure_s = longest_s * std::pow(factor, j + 1 - count);
    SimulateOptions options;
    options.seed = seed;
    options.frame = static_cast<std::uint32_t>(j);
    series.images.push_back(simulate(scene, {}, options).image);
    series.exposures_s.push_back(sensor.exposure_s);
  }
  return series;
}

}  // namespace occ::test
