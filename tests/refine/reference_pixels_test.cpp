// SPDX-License-Identifier: Apache-2.0
// Poses from pixels, bounds, and the model of the pixels' noise, compared with those of an earlier
// version.
#include <gtest/gtest.h>

#include "libocc/detect/detect.hpp"
#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/emission.hpp"
#include "libocc/refine/internal/pixel_noise.hpp"
#include "libocc/refine/internal/pixel_window.hpp"
#include "tests/refine/reference_rooms.hpp"
#include "tests/support/pixel_blobs.hpp"

namespace occ::test {
namespace {

using namespace internal::refine;

void randomise_sensor(Scene& scene, Random& random) {
  Sensor& sensor = scene.sensor;
  const int bits[] = {8, 8, 12, 16};
  sensor.bit_depth = bits[random.below(4)];
  sensor.full_well_e = even_log(random, 3e3, 1e5);
  sensor.gain_dn_per_e = sensor.full_scale_dn() / sensor.full_well_e * random.uniform(0.5, 1.3);
  sensor.read_noise_e = even_log(random, 0.5, 30);
  sensor.black_level_dn = random.below(6);
  sensor.dark_current_e_per_s = occurs(random, 0.2) ? 1e6 : 0;
  sensor.psf_sigma_px = random.uniform(0.5, 1.4);
  if (occurs(random, 0.2)) sensor.response = Response::gamma;
  if (occurs(random, 0.1)) sensor.response = Response::srgb;
  if (occurs(random, 0.1)) scene.lens.vignetting = {-0.2};
}

/// Powers with which the brightest lamp has this part of the full well.
void scale_powers(Scene& scene, const Rigid3& pose, double part) {
  double brightest_e = 0;
  for (const Lamp& lamp : scene.lamps) {
    if (lamp.shape == LampShape::point) continue;
    const auto px = scene.camera.project(pose * lamp.centre_m);
    brightest_e = std::max(brightest_e, scene.sensor.electrons(irradiance_at(
                                            lamp, pose, scene.camera, scene.sensor, *px)));
  }
  if (!(brightest_e > 0)) return;
  for (Lamp& lamp : scene.lamps) lamp.power_w *= part * scene.sensor.full_well_e / brightest_e;
}

TEST(References, RefinedPosesOfPixels) {
  References references("refine/pixels");
  for (std::uint64_t i = 0; i < 90; ++i) {
    Random random(91, i);
    MeasuredRoom room;
    room.truth = random_room_pose(random);
    room.scene = random_room_scene(random, room.truth, 3 + random.below(4));
    randomise_sensor(room.scene, random);
    if (occurs(random, 0.15)) room.scene.lamps[0].photometry = profile_of(batwing, 5, 15);
    scale_powers(room.scene, room.truth, occurs(random, 0.2) ? 3 : random.uniform(0.1, 0.8));
    room.scene.validate();
    const Frame frame = make_frame(room.scene, room.truth, i);
    room.blobs = frame.blobs;
    room.matches = frame.matches;
    if (room.matches.size() < 3) continue;
    // The statements of the scene may be wrong.
    if (occurs(random, 0.3)) room.scene.sensor.psf_sigma_px *= random.uniform(0.7, 1.4);
    if (occurs(random, 0.3))
      for (Lamp& lamp : room.scene.lamps) lamp.half_power_rad = random.uniform(0.6, 1.25);
    if (occurs(random, 0.1)) room.scene.lamps[0].radius_m *= 1.1;
    if (occurs(random, 0.1))
      room.scene.lamps[0].position_sigma_m = Eigen::Vector3d(0.01, 0.01, 0.01);
    room.options = random_refine_options(room, random);
    if (!occurs(random, 0.1)) room.options.rung = Rung::direct;
    Vector6 off;
    for (double& value : off) value = 3e-3 * random.normal();
    const Result<Refined> refined = refine(perturb(room.truth, off), room.matches, room.blobs,
                                           room.scene, room.options, frame.image.view());
    CaseResults results;
    add_refined(results, refined);
    add_conclusions(results, refined, room);
    if (refined.ok()) {
      const Result<PoseBound> bound =
          pose_bound(room.matches, room.blobs, room.scene, refined->cam_from_world, room.options,
                     frame.image.view());
      results.summarise("bound", signed_roots(bound->covariance));
    }
    references.add("frame " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

void add_bound(CaseResults& results, const Result<PoseBound>& bound) {
  results.add("bound", std::vector<double>{static_cast<double>(bound.status),
                                           static_cast<double>(bound->rank),
                                           static_cast<double>(bound->lamps)});
  if (!bound.ok()) return;
  results.summarise("pose", signed_roots(bound->covariance));
  results.summarise("position", signed_roots(bound->position_covariance_m2));
}

TEST(References, BoundsOfScenes) {
  References references("refine/bounds");
  for (std::uint64_t i = 0; i < 80; ++i) {
    Random random(92, i);
    const Rigid3 pose = random_room_pose(random);
    Scene scene = random_room_scene(random, pose, 1 + random.below(6));
    randomise_sensor(scene, random);
    if (occurs(random, 0.15)) scene.lamps[0].photometry = profile_of(batwing, 5, 15);
    if (occurs(random, 0.1)) scene.lamps[0].frequency_hz = 1000;
    scale_powers(scene, pose, occurs(random, 0.2) ? 3 : random.uniform(0.1, 0.8));
    if (occurs(random, 0.5)) add_map_errors(scene, random);
    scene.lamps.push_back(disc_lamp(99, {0.2, 0.1, 3}));  // cut by the border or outside
    scene.validate();
    CaseResults results;
    for (const Rung rung : {Rung::points, Rung::centres, Rung::rims, Rung::direct})
      for (const FluxModel flux :
           {FluxModel::ignore, FluxModel::known_power, FluxModel::common_factor})
        add_bound(results, pose_bound(scene, pose, rung, flux));
    std::vector<Eigen::Vector3d> points;
    std::vector<double> sigmas_px;
    for (const Lamp& lamp : scene.lamps) {
      points.push_back(lamp.centre_m);
      sigmas_px.push_back(random.uniform(0.1, 2));
    }
    add_bound(results, pose_bound(points, scene.camera, pose, sigmas_px));
    references.add("scene " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, MomentsOfPixels) {
  References references("refine/pixel_noise");
  for (std::uint64_t i = 0; i < 80; ++i) {
    Random random(93, i);
    Scene scene;
    randomise_sensor(scene, random);
    if (i % 3 == 0) scene.sensor.read_noise_e = random.uniform(0, 1) / scene.sensor.gain_dn_per_e;
    const PixelNoise noise(scene.sensor);
    CaseResults results;
    results.add("range", std::vector<double>{noise.dark_e(), noise.white_e()});
    const double unit_e = 1 / scene.sensor.gain_dn_per_e;
    for (int k = -60; k < 140; ++k) {
      // Around black, over the whole range, and around white.
      const double mean_e = k < 0    ? 0.17 * (k + 40) * unit_e
                            : k < 60 ? k / 60.0 * noise.white_e()
                                     : noise.white_e() * (1 + 0.005 * (k - 100));
      const PixelMoments m = noise.at(mean_e);
      if (k % 10 == 0)
        results.add("at",
                    std::vector<double>{m.mean, m.slope, m.variance, m.informative ? 1.0 : 0});
    }
    std::vector<double> faint, bright;
    for (int k = 0; k < 200; ++k) {
      const PixelMoments low = noise.at((0.05 * k - 3) * unit_e);
      const PixelMoments high = noise.at(noise.white_e() + (k - 150) * unit_e);
      faint.insert(faint.end(), {low.mean / unit_e, low.slope, low.variance / square(unit_e)});
      bright.insert(bright.end(), {high.mean / noise.white_e(), high.slope,
                                   high.variance / noise.white_e(), high.informative ? 1.0 : 0});
    }
    results.summarise("faint", faint);
    results.summarise("bright", bright);
    references.add("sensor " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, WindowsOfPixels) {
  References references("refine/windows");
  for (std::uint64_t i = 0; i < 40; ++i) {
    Random random(94, i);
    Image image;
    image.width = 60 + random.below(30);
    image.height = 50 + random.below(20);
    image.channels = i % 2 == 0 ? 1 : static_cast<int>(3 + i % 4 / 3);
    Scene scene;
    randomise_sensor(scene, random);
    image.type = scene.sensor.bit_depth > 8 ? PixelType::u16 : PixelType::u8;
    for (int k = 0; k < image.width * image.height * image.channels; ++k) {
      const int value = random.below(static_cast<int>(scene.sensor.full_scale_dn()) + 1);
      if (image.type == PixelType::u8)
        image.u8.push_back(static_cast<std::uint8_t>(value));
      else
        image.u16.push_back(static_cast<std::uint16_t>(value));
    }
    std::vector<Blob> blobs(4);
    for (Blob& blob : blobs) {
      blob.x0 = random.below(image.width - 12);
      blob.y0 = random.below(image.height - 12);
      blob.x1 = blob.x0 + random.below(12);
      blob.y1 = blob.y0 + random.below(12);
    }
    const WindowReader reader(image.view(), scene.sensor);
    CaseResults results;
    for (std::size_t k = 0; k < blobs.size(); ++k) {
      const BlobWindow window = reader.read(blobs, k);
      std::vector<double> values{static_cast<double>(window.x0), static_cast<double>(window.y0),
                                 static_cast<double>(window.width),
                                 static_cast<double>(window.height)};
      for (const float e : window.electrons)
        values.push_back(std::isnan(e) ? -1 : static_cast<double>(e) / scene.sensor.full_well_e);
      results.summarise("window", values);
    }
    references.add("image " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, SlopesOfEmission) {
  References references("refine/emission");
  for (std::uint64_t i = 0; i < 40; ++i) {
    Random random(95, i);
    const Rigid3 pose = random_room_pose(random);
    const Scene scene = random_room_scene(random, pose, 1);
    const Lamp& lamp = scene.lamps[0];
    const auto px = scene.camera.project(pose * lamp.centre_m);
    const Eigen::Vector2d reach(random.uniform(2, 60), random.uniform(2, 60));
    const EmissionSlope slope(lamp, pose, scene.camera, *px, reach);
    std::vector<double> values;
    for (int k = 0; k < 20; ++k)
      values.push_back(100 * slope.at(px->x() + random.uniform(-1, 1) * reach.x(),
                                      px->y() + random.uniform(-1, 1) * reach.y()));
    CaseResults results;
    results.summarise("slope", values);
    Lamp changed = lamp;
    change_order(lamp, random.uniform(0.2, 5), pose, changed);
    results.add("changed", std::vector<double>{changed.power_w, changed.half_power_rad});
    references.add("lamp " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
