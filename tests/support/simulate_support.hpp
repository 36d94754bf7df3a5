// SPDX-License-Identifier: Apache-2.0
// Images without noise and with fine quantisation, for the tests of the renderer.
#pragma once

#include "libocc/formation/light.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

inline SimulateOptions noiseless(double start_s = 0) {
  SimulateOptions options;
  options.noise = false;
  options.start_s = start_s;
  return options;
}

/// Mean electrons of every pixel (x, y), to a 60000th of `peak_e`: a 16-bit rendering with a gain
/// that makes the peak nearly white.
inline Eigen::MatrixXd mean_electrons(Scene scene, const Rigid3& pose, double peak_e,
                                      SimulateOptions options = {}) {
  options.noise = false;
  Sensor& sensor = scene.sensor;
  sensor.bit_depth = 16;
  sensor.gain_dn_per_e = 60000 / peak_e;
  sensor.black_level_dn = 0;
  sensor.full_well_e = 10 * peak_e;
  sensor.response = Response::linear;
  const Image image = simulate(scene, pose, options).image;
  Eigen::MatrixXd electrons(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      electrons(x, y) = image.u16[y * image.width + x] / sensor.gain_dn_per_e;
  return electrons;
}

/// Upper bound of the electrons of any pixel of the scene, for any phase of its lamps.
inline double peak_electrons(Scene scene, const Rigid3& pose) {
  double peak_e = 0;
  for (Lamp& lamp : scene.lamps) {
    lamp.frequency_hz.reset();
    lamp.waveform.clear();
    const double all = lamp_electrons(lamp, pose, scene.camera, scene.sensor);
    const auto px = scene.camera.project(pose * lamp.centre_m);
    const double full =
        lamp.shape == LampShape::point || !px || scene.effects.of(Effect::extent) == Use::off
            ? all
            : 2 * scene.sensor.electrons(
                      irradiance_at(lamp, pose, scene.camera, scene.sensor, *px));
    peak_e += 1.01 * std::min(all, full);
  }
  for (int i = 0; i < 2; ++i) peak_e = 1.1 * mean_electrons(scene, pose, peak_e).maxCoeff();
  return peak_e;
}

}  // namespace occ::test
