// SPDX-License-Identifier: Apache-2.0
// Many images by one Renderer: the bits of an image depend only on its own pose and options, not on
// other images or the processor's instructions.
#include "libocc/simulate/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

/// Hash of the image: FNV-1a, 64 bits.
std::uint64_t hash_of(const Image& image) {
  std::uint64_t hash = 14695981039346656037ull;
  const auto add = [&](unsigned byte) { hash = (hash ^ byte) * 1099511628211ull; };
  for (const std::uint8_t pixel : image.u8) add(pixel);
  for (const std::uint16_t pixel : image.u16) {
    add(pixel & 0xffu);
    add(pixel >> 8);
  }
  return hash;
}

std::vector<Simd> simd_levels() {
  std::vector<Simd> levels;
  for (const Simd level : {Simd::baseline, Simd::avx2, Simd::avx512})
    if (level <= widest_simd()) levels.push_back(level);
  return levels;
}

Rigid3 room_pose(double turn = 0) {
  return look_at({2 + 0.2 * turn, 2, 0.3}, {2, 2.3 + 0.1 * turn, 3}, Eigen::Vector3d::UnitY());
}

/// Scenes that together use every branch of the sensor model.
std::map<std::string, Scene> scenes() {
  std::map<std::string, Scene> all;
  Scene room = irregular_room();
  room.camera = Camera::pinhole(323, 240, 211, 211, 161, 119.5);
  all["plain"] = room;
  Scene& deep = all["deep"] = room;
  deep.sensor.bit_depth = 12;
  deep.sensor.gain_dn_per_e = 0.35;
  deep.sensor.read_noise_e = 3;
  deep.sensor.dark_current_e_per_s = 2e6;
  Scene& curved = all["curved"] = room;
  curved.sensor.response = Response::srgb;
  curved.sensor.psf_sigma_px = 1.7;
  Scene& overexposed = all["overexposed"] = room;
  overexposed.sensor.exposure_s *= 2.2;
  overexposed.sensor.gain_sigma = 0.02;
  overexposed.sensor.blooming = 0.5;
  Scene& coloured = all["coloured"] = room;
  coloured.sensor.mosaic = Mosaic::grbg;
  coloured.sensor.channels = {{0.6, Response::linear, 2.2, {}},
                              {1, Response::gamma, 1.8, {}},
                              {0.4, Response::srgb, 2.2, {}}};
  coloured.lamps[2].colour = {1, 0.4, 0.2};
  Scene& quiet = all["quiet"] = room;
  quiet.sensor.read_noise_e = 0.4;
  return all;
}

Image image_of(const Scene& scene, Simd simd, const SimulateOptions& options, double turn = 0) {
  Rendered rendered;
  Renderer(scene, {simd}).render(room_pose(turn), options, rendered);
  return rendered.image;
}

TEST(Renderer, GivesTheSameBitsWithAllInstructions) {
  SimulateOptions noisy;
  noisy.seed = 3;
  noisy.frame = 7;
  for (const auto& [name, scene] : scenes())
    for (const SimulateOptions& options : {noiseless(), noisy}) {
      const Image baseline = image_of(scene, Simd::baseline, options);
      for (const Simd simd : simd_levels()) {
        const Image image = image_of(scene, simd, options);
        EXPECT_EQ(image.u8, baseline.u8) << name;
        EXPECT_EQ(image.u16, baseline.u16) << name;
      }
    }
}

TEST(Renderer, GivesTheBitsOfSimulate) {
  SimulateOptions options;
  options.seed = 9;
  for (const auto& [name, scene] : scenes()) {
    const Rendered once = simulate(scene, room_pose(), options);
    const Image image = image_of(scene, widest_simd(), options);
    EXPECT_EQ(image.u8, once.image.u8) << name;
    EXPECT_EQ(image.u16, once.image.u16) << name;
  }
}

TEST(Renderer, AnImageDoesNotDependOnEarlierImages) {
  std::vector<SimulateOptions> options(4);
  options[1].noise_area = NoiseArea::around_lamps;
  options[2].noise = false;
  options[3].noise = false;
  options[3].start_s = 1e-3;
  for (auto& [name, scene] : scenes()) {
    Scene blinking = scene;
    blinking.lamps[1].frequency_hz = 2000;
    blinking.sensor.row_time_s = 1e-5;
    Renderer renderer(blinking);
    Rendered out;
    Random random(5);
    for (int i = 0; i < 40; ++i) {
      SimulateOptions now = options[random.below(4)];
      now.frame = static_cast<std::uint32_t>(random.below(3));
      const Rigid3 pose = room_pose(random.uniform(-8, 8));  // lamps enter and leave the image
      renderer.render(pose, now, out);
      const Rendered fresh = simulate(blinking, pose, now);
      ASSERT_EQ(out.image.u8, fresh.image.u8) << name << ' ' << i;
      ASSERT_EQ(out.image.u16, fresh.image.u16) << name << ' ' << i;
      ASSERT_EQ(out.cam_from_world.matrix(), pose.matrix());
      ASSERT_EQ(out.lamps.size(), fresh.lamps.size());
      for (std::size_t k = 0; k < out.lamps.size(); ++k) {
        EXPECT_EQ(out.lamps[k].electrons, fresh.lamps[k].electrons);
        EXPECT_EQ(out.lamps[k].rim_px, fresh.lamps[k].rim_px);
      }
    }
  }
}

TEST(Renderer, FillsAnyGivenImage) {
  const auto all = scenes();
  Rendered out;
  for (int round = 0; round < 2; ++round)
    for (const char* name : {"plain", "deep", "curved", "coloured"}) {
      Renderer(all.at(name)).render(room_pose(), noiseless(), out);
      const Rendered fresh = simulate(all.at(name), room_pose(), noiseless());
      EXPECT_EQ(out.image.u8, fresh.image.u8) << name;
      EXPECT_EQ(out.image.u16, fresh.image.u16) << name;
    }
  Scene small = all.at("plain");
  small.camera = Camera::pinhole(100, 80, 70, 70, 49.5, 39.5);
  Renderer renderer(small);
  renderer.render(room_pose(), noiseless(), out);
  EXPECT_EQ(out.image.u8.size(), 8000u);
  const Image taken = std::move(out.image);
  renderer.render(room_pose(), noiseless(), out);
  EXPECT_EQ(out.image.u8, taken.u8);
  // As many pixels, in rows of another length.
  small.camera = Camera::pinhole(80, 100, 70, 70, 39.5, 49.5);
  Renderer(small).render(room_pose(), noiseless(), out);
  EXPECT_EQ(out.image.width, 80);
  EXPECT_EQ(out.image.u8, simulate(small, room_pose(), noiseless()).image.u8);
}

TEST(Renderer, AFailedCallDoesNotChangeIt) {
  Renderer renderer(scenes().at("plain"));
  Rendered out;
  renderer.render(room_pose(), noiseless(), out);
  const Image before = out.image;
  Rigid3 bad = room_pose();
  bad.translation.x() = std::nan("");
  EXPECT_THROW(renderer.render(bad, noiseless(), out), std::invalid_argument);
  SimulateOptions options;
  options.spacing_sigma = -1;
  EXPECT_THROW(renderer.render(room_pose(), options, out), std::invalid_argument);
  Renderer moved = std::move(renderer);
  moved.render(room_pose(), noiseless(), out);
  EXPECT_EQ(out.image.u8, before.u8);
  Scene scene = irregular_room();
  scene.lamps[0].radius_m = -1;
  EXPECT_THROW(Renderer{scene}, std::invalid_argument);
}

TEST(NoiseAroundLamps, IsThatOfNoiseEverywhereAndNoneElsewhere) {
  for (const auto& [name, scene] : scenes()) {
    SimulateOptions options;
    options.seed = 4;
    const Rendered everywhere = simulate(scene, room_pose(), options);
    EXPECT_FALSE(everywhere.background_dn);
    const Rendered clean = simulate(scene, room_pose(), noiseless());
    options.noise_area = NoiseArea::around_lamps;
    const Rendered around = simulate(scene, room_pose(), options);
    ASSERT_TRUE(around.background_dn);
    EXPECT_EQ(around.background_dn, clean.background_dn);
    const auto level = [](const Image& image, int x, int y) {
      const auto i = static_cast<std::size_t>(y * image.width + x);
      return image.type == PixelType::u8 ? image.u8[i] : image.u16[i];
    };
    int inside = 0, noisy = 0;
    for (int y = 0; y < around.image.height; ++y)
      for (int x = 0; x < around.image.width; ++x) {
        const bool is_inside =
            std::any_of(around.lit.begin(), around.lit.end(), [&](const PixelRectangle& r) {
              return x >= r.x0 && x < r.x0 + r.width && y >= r.y0 && y < r.y0 + r.height;
            });
        const Image& expected = is_inside ? everywhere.image : clean.image;
        ASSERT_EQ(level(around.image, x, y), level(expected, x, y)) << name << ' ' << x << ' ' << y;
        if (!is_inside) {
          const auto place = static_cast<std::size_t>(2 * (y % 2) + x % 2);
          ASSERT_EQ(level(clean.image, x, y), (*clean.background_dn)[place]);
        }
        inside += is_inside;
        noisy += level(around.image, x, y) != level(clean.image, x, y);
      }
    EXPECT_GT(noisy, 500) << name;
    EXPECT_LT(inside, 323 * 240 / 2) << name;
  }
}

// Hashes of images of these scenes. A change of any bit must be intended, otherwise it is an error.
// Exactly drawn noise of lit pixels depends on the C library.
TEST(Golden, Images) {
  SimulateOptions noisy;
  noisy.seed = 11;
  noisy.frame = 2;
  const std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> golden{
      {"coloured", {0xdb22a618cfce0d04ull, 0x7753bb7a81cd481eull}},
      {"curved", {0x602374f16b54407full, 0x4578fe44648bf3c9ull}},
      {"deep", {0xce7f743e4b731ba6ull, 0x8a58ce54a78e7f36ull}},
      {"overexposed", {0xb2115645d2904c62ull, 0x27f4fd33392d2654ull}},
      {"plain", {0xcb35b5b777c5158dull, 0xc8884fa725b4af17ull}},
      {"quiet", {0xcb35b5b777c5158dull, 0xa8b213c4232bca21ull}},
  };
  for (const auto& [name, scene] : scenes())
    for (const Simd simd : simd_levels()) {
      EXPECT_EQ(hash_of(image_of(scene, simd, noiseless(), 1)), golden.at(name).first) << name;
      EXPECT_EQ(hash_of(image_of(scene, simd, noisy, 1)), golden.at(name).second) << name;
    }
}

}  // namespace
