// SPDX-License-Identifier: Apache-2.0
// Blooming over a background: the charge beyond the full well fills the pixels above and below it
// up to the full well, of which the background already takes a part.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "tests/support/simulate_support.hpp"

namespace occ {
namespace {

constexpr double blooming_full_e = 20000;

/// A lamp of 8 px radius, 1.5 times too bright, with light on every pixel.
Scene bloomed_scene(double ambient_w_m2) {
  Scene scene;
  scene.camera = Camera::pinhole(64, 200, 160, 160, 31.6, 99.7);
  scene.lamps = {test::disc_lamp(0, {0, 0, 2}, 0.1)};
  scene.lamps[0].normal = {0, 0, -1};
  scene.ambient_w_m2 = ambient_w_m2;
  Sensor& sensor = scene.sensor;
  sensor.bit_depth = 16;
  sensor.gain_dn_per_e = 1;
  sensor.black_level_dn = 0;
  sensor.full_well_e = blooming_full_e;
  scene.validate();
  const double now =
      sensor.electrons(irradiance_at(scene.lamps[0], {}, scene.camera, sensor, {31.6, 99.7}));
  scene.lamps[0].power_w *= 1.5 * blooming_full_e / now;
  return scene;
}

Eigen::MatrixXd bloomed_image(const Scene& scene) {
  const Image image = simulate(scene, {}, test::noiseless()).image;
  Eigen::MatrixXd electrons(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) electrons(x, y) = image.u16[y * image.width + x];
  return electrons;
}

TEST(BloomingOverABackground, FillsEachColumnToTheFullWell) {
  for (const double share : {0.0, 0.5}) {
    Scene scene = bloomed_scene(0);
    if (share > 0) {  // ambient light of this share of the full well
      scene.ambient_w_m2 = 1e-3;
      Scene dark = scene;
      dark.lamps.clear();
      scene.ambient_w_m2 *= share * blooming_full_e / bloomed_image(dark)(0, 0);
    }
    Scene deep = scene;
    deep.sensor.full_well_e = 10 * blooming_full_e;
    const Eigen::MatrixXd light = bloomed_image(deep);
    for (const double blooming : {1.0, 0.4}) {
      scene.sensor.blooming = blooming;
      const Eigen::MatrixXd seen = bloomed_image(scene);
      EXPECT_LE(seen.maxCoeff(), blooming_full_e + 1);
      for (int x = 0; x < seen.rows(); ++x) {
        double beyond = 0, gained = 0;
        for (int y = 0; y < seen.cols(); ++y) {
          beyond += std::max(0.0, light(x, y) - blooming_full_e);
          gained += seen(x, y) - std::min(light(x, y), blooming_full_e);
        }
        // The rest of the charge beyond the full well is lost. Each pixel is rounded.
        EXPECT_NEAR(gained, blooming * beyond, 0.01 * beyond + 60) << x << ", " << share;
        if (beyond < 2000) continue;
        // Outwards from the lamp, full pixels are followed by at most one partly filled pixel.
        for (const int side : {-1, 1}) {
          int partly = 0;
          for (int y = 100; y > 0 && y < 199; y += side) {
            const bool full = seen(x, y) > blooming_full_e - 2;
            const bool changed = seen(x, y) > light(x, y) + 2;
            partly += changed && !full;
            EXPECT_FALSE(partly > 0 && full) << x << " " << y;
          }
          EXPECT_LE(partly, 1) << x;
        }
      }
    }
  }
}

TEST(BloomingOverABackground, ChargeThatReachesTheBorderIsLost) {
  Scene scene = bloomed_scene(0);
  scene.camera = Camera::pinhole(64, 200, 160, 160, 31.6, 3.2);
  scene.sensor.blooming = 1;
  const Eigen::MatrixXd seen = bloomed_image(scene);
  EXPECT_NEAR(seen(31, 0), blooming_full_e, 1);
  // The part that moves down is that of a lamp far from the border.
  Scene middle = bloomed_scene(0);
  middle.sensor.blooming = 1;
  const auto end = [](const Eigen::MatrixXd& image, int from) {
    int y = from;
    while (y < 199 && image(31, y) > blooming_full_e - 2) ++y;
    return y - from;
  };
  EXPECT_GT(end(seen, 3), 8);
  EXPECT_LE(end(seen, 3), end(bloomed_image(middle), 100) + 2);
}

}  // namespace
}  // namespace occ
