// SPDX-License-Identifier: Apache-2.0
// Effects of the sensor: gain non-uniformity, colour filters, blooming.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/simulate/renderer.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

Rigid3 room_pose() { return look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0}); }

Scene small_room() {
  Scene scene = irregular_room();
  scene.camera = Camera::pinhole(320, 240, 211, 211, 159.5, 119.5);
  return scene;
}

Scene evenly_lit() {
  Scene scene = small_room();
  scene.lamps.clear();
  scene.ambient_w_m2 = 0.5;
  return scene;
}

double even_electrons(const Scene& scene) {
  return scene.sensor.electrons(scene.ambient_w_m2) - scene.sensor.electrons(0);
}

Image deep_image(Scene scene, const SimulateOptions& options = noiseless()) {
  scene.sensor.bit_depth = 16;
  scene.sensor.black_level_dn = 0;
  return simulate(scene, room_pose(), options).image;
}

TEST(Gain, IsAFixedNormalFactorOfEachPixel) {
  Scene scene = evenly_lit();
  scene.sensor.gain_sigma = 0.01;
  scene.sensor.full_well_e = 1e7;
  scene.sensor.gain_dn_per_e = 30000 / even_electrons(scene);
  SimulateOptions other = noiseless();
  other.seed = 5;
  other.frame = 3;
  const Image image = deep_image(scene);
  EXPECT_EQ(image.u16,
            deep_image(scene, other).u16);  // the gain belongs to the sensor, not to the frame
  double sum = 0, squares = 0, cubes = 0;
  for (const std::uint16_t level : image.u16) {
    const double z = (level / 30000.0 - 1) / 0.01;
    sum += z;
    squares += z * z;
    cubes += z * z * z;
  }
  const double n = static_cast<double>(image.u16.size());
  EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 4 * std::sqrt(2 / n));
  EXPECT_NEAR(cubes / n, 0, 4 * std::sqrt(15 / n));
  scene.sensor.gain_seed = 1;
  const Image another = deep_image(scene);
  double product = 0;
  for (std::size_t i = 0; i < image.u16.size(); ++i)
    product += (image.u16[i] / 30000.0 - 1) * (another.u16[i] / 30000.0 - 1) / 1e-4;
  EXPECT_NEAR(product / n, 0, 4 / std::sqrt(n));
}

TEST(Mosaic, GivesEachPixelItsFractionOfTheLight) {
  Scene scene = small_room();
  scene.sensor.full_well_e = 1e7;
  scene.sensor.gain_dn_per_e = 2;
  const Image white = deep_image(scene);
  scene.sensor.mosaic = Mosaic::gbrg;
  scene.sensor.channels = {{0.5, Response::linear, 2.2, {}},
                           {0.8, Response::linear, 2.2, {}},
                           {0.25, Response::linear, 2.2, {}}};
  for (Lamp& lamp : scene.lamps) lamp.colour = {1, 0.5, 0.2};
  const Image coloured = deep_image(scene);
  const double factors[2][2] = {{0.4, 0.05}, {0.5, 0.4}};  // green blue / red green
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const auto i = static_cast<std::size_t>(y * 320 + x);
      ASSERT_NEAR(coloured.u16[i], factors[y % 2][x % 2] * white.u16[i], 1) << x << ' ' << y;
    }
  EXPECT_GT(*std::max_element(white.u16.begin(), white.u16.end()), 1000);
}

TEST(Mosaic, FiltersGhostsGlareAmbientLightAndWalls) {
  Scene scene = small_room();
  scene.sensor.full_well_e = 1e7;
  scene.sensor.gain_dn_per_e = 200;
  scene.lens.ghosts = {{0.001, -0.7, 1}};
  scene.lens.veiling_glare = 0.05;
  scene.room = Room{{4, 4, 3.5}, 0.5};
  for (Lamp& lamp : scene.lamps) lamp.power_w *= 0.3;
  const Image white = deep_image(scene);
  scene.sensor.mosaic = Mosaic::rggb;
  for (Lamp& lamp : scene.lamps) lamp.colour = {0.5, 0.25, 1};
  const Image coloured = deep_image(scene);
  const double factors[2][2] = {{0.5, 0.25}, {0.25, 1}};
  double largest = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const auto i = static_cast<std::size_t>(y * 320 + x);
      if (white.u16[i] > 60000) continue;
      // Glare has the colour of all light; its amount depends on the pixels that the lamps cover.
      largest =
          std::max(largest, std::abs(coloured.u16[i] - factors[y % 2][x % 2] * white.u16[i]) - 1);
    }
  EXPECT_LT(largest, 0.01 * *std::min_element(white.u16.begin(), white.u16.end()));
  EXPECT_GT(*std::min_element(white.u16.begin(), white.u16.end()), 100);
}

/// Signal electrons of each pixel, to 0.05 electrons (one grey level).
std::vector<double> electrons_of(const Scene& scene) {
  Scene fine = scene;
  fine.sensor.gain_dn_per_e = 60000 / scene.sensor.full_well_e;
  std::vector<double> all;
  for (const std::uint16_t level : deep_image(fine).u16)
    all.push_back(level / fine.sensor.gain_dn_per_e);
  return all;
}

TEST(Blooming, MovesChargeAlongColumnsUntilNoneIsLeft) {
  Scene scene = small_room();
  scene.lamps.resize(1);
  scene.lamps[0].centre_m = {2.05, 2.05, 3};
  const double full = scene.sensor.full_well_e;
  const std::vector<double> once = electrons_of(scene);
  const double peak = *std::max_element(once.begin(), once.end());
  ASSERT_LT(peak, full);
  scene.lamps[0].power_w *= 1.5 * full / peak;  // exceeds the full well
  const double sum_before = std::accumulate(once.begin(), once.end(), 0.0) * 1.5 * full / peak;
  scene.sensor.blooming = 1;
  const std::vector<double> bloomed = electrons_of(scene);
  const double sum = std::accumulate(bloomed.begin(), bloomed.end(), 0.0);
  EXPECT_NEAR(sum, sum_before, 1e-3 * sum_before);  // no charge is lost
  scene.sensor.blooming = 0.5;
  scene.effects.set(Effect::blooming, Use::off);
  const std::vector<double> clipped = electrons_of(scene);
  scene.effects.set(Effect::blooming, Use::on);
  const std::vector<double> half = electrons_of(scene);
  const auto total = [](const std::vector<double>& e) {
    return std::accumulate(e.begin(), e.end(), 0.0);
  };
  EXPECT_NEAR(total(half) - total(clipped), 0.5 * (sum_before - total(clipped)), 1e-3 * sum_before);
  for (int x = 0; x < 320; ++x) {  // only columns with a full pixel change
    double most = 0, change = 0;
    for (int y = 0; y < 240; ++y) {
      const auto i = static_cast<std::size_t>(y * 320 + x);
      most = std::max(most, clipped[i]);
      change = std::max(change, bloomed[i] - clipped[i]);
      EXPECT_GE(bloomed[i], clipped[i]);
    }
    EXPECT_TRUE(most > 0.999 * full || change == 0) << x;
  }
}

TEST(SensorEffects, EffectsThatAreOffChangeNoBit) {
  const Scene plain = small_room();
  SimulateOptions noisy;
  noisy.seed = 8;
  Scene without = plain;
  without.sensor.gain_sigma = 0.1;
  without.sensor.mosaic = Mosaic::rggb;
  without.sensor.blooming = 0.7;
  without.sensor.response = Response::srgb;
  EXPECT_NE(simulate(without, room_pose(), noisy).image.u8,
            simulate(plain, room_pose(), noisy).image.u8);
  for (const Effect off : {Effect::gain, Effect::mosaic, Effect::blooming, Effect::response})
    without.effects.set(off, Use::off);
  EXPECT_EQ(simulate(without, room_pose(), noisy).image.u8,
            simulate(plain, room_pose(), noisy).image.u8);
}

}  // namespace
