// SPDX-License-Identifier: Apache-2.0
// Lamps on one line, such as those of a corridor. Their centres leave a rotation about the line
// open in each picture and in the map; their rims determine it.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "libocc/detect/detect.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

constexpr double lamp_radius_m = 0.12;

/// Lamps on a line, at uneven distances or all at 1.5 m.
Scene corridor(int count, bool is_regular = false) {
  constexpr double steps_m[] = {1.3, 1.8, 1.5, 1.9, 1.2, 1.6};
  std::vector<Vector3d> lamps;
  double x = 0;
  for (int i = 0; i < count; ++i) {
    lamps.push_back({x, 0, 2.7});
    x += is_regular ? 1.5 : steps_m[i % 6];
  }
  Scene scene = room_of(lamps);
  scene.camera = Camera::pinhole(1280, 960, 600, 600, 639.5, 479.5);
  for (Lamp& lamp : scene.lamps) lamp.radius_m = lamp_radius_m;
  return scene;
}

/// Fifty pictures along the corridor.
std::vector<MadePicture> walk_along(const Scene& scene, std::uint64_t seed) {
  constexpr int count = 50;
  constexpr double noise_px = 0.03;
  Random random(seed);
  std::vector<MadePicture> made;
  const double phase = random.uniform(0, 6);
  const double length = scene.lamps.back().centre_m.x();
  for (int i = 0; i < count; ++i) {
    const double part = static_cast<double>(i) / (count - 1), swing = 12 * part;
    const Vector3d at((length - 3) * part, 0.4 * std::sin(swing + phase),
                      0.1 * std::cos(2 * swing));
    const Vector3d target = at + Vector3d(0.8 + 0.05 * random.normal(), 0.03 * random.normal(), 1);
    made.push_back(make_picture(scene, look_at(at, target, {0, 1, 0}), "frame " + std::to_string(i),
                                noise_px, random));
  }
  return made;
}

void check_corridor(bool is_regular, std::uint64_t seed) {
  const Scene scene = corridor(9, is_regular);
  const auto made = walk_along(scene, seed);
  SurveyOptions options;
  options.ordered = true;
  options.radius_m = lamp_radius_m;
  options.radius_sigma = 1e-4;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_GE(truth.size(), 8u);
  EXPECT_LT(worst_distance_m(*found, scene, truth), 0.05);  // of 12 m
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_LT(std::acos(-lamp.lamp.normal.z()), 0.02);  // z is up
    EXPECT_NEAR(lamp.lamp.radius_m, lamp_radius_m, 0.02 * lamp_radius_m);
  }
}

TEST(Corridor, IsMappedByRims) { check_corridor(false, 3); }

TEST(Corridor, OfUnorderedPicturesIsNotMappedWrongly) {
  const Scene scene = corridor(9);
  const auto made = walk_along(scene, 3);
  const auto found = survey(pictures_of(made), scene.camera);
  EXPECT_EQ(found.status, Status::ambiguous) << found.message;
}

TEST(Corridor, ARegularOneIsMappedFromAVideo) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) check_corridor(true, seed);
}

TEST(Corridor, OfSmallLampsIsRefused) {
  const Scene scene = corridor(9);
  auto made = walk_along(scene, 3);
  for (MadePicture& one : made) {
    one.picture.tracks = one.lamps;
    for (Blob& blob : one.picture.blobs) blob.rim.clear();
  }
  const auto found = survey(pictures_of(made), scene.camera);
  EXPECT_FALSE(found.ok());
  EXPECT_NE(found.message.find("not on one line"), std::string::npos) << found.message;
}

TEST(Corridor, APictureOfOneRowHasTheRightPose) {
  const Scene scene = room_of({{0.5, 1, 2.7},
                               {1.1, 1.003, 2.7},
                               {1.6, 1, 2.703},
                               {2.3, 0.998, 2.7},
                               {0.8, 2.4, 2.7},
                               {2.1, 2.5, 2.5},
                               {1.9, -0.3, 2.7}});
  auto made = walk(scene, 20, 4);
  Random random(7);
  made.push_back(
      make_picture(scene, look_at({1.4, 1.2, 1.3}, {1.4, 1, 2.7}, {0, 1, 0}), "row", 0.03, random));
  ASSERT_EQ(made.back().lamps, (std::vector<int>{0, 1, 2, 3}));
  const auto found = survey(pictures_of(made), scene.camera);
  ASSERT_TRUE(found.ok()) << found.message;
  const int image = found->image_of_picture.back();
  ASSERT_GE(image, 0);
  std::vector<CheckPoint> points;
  const std::vector<int> truth = truth_of(*found, made);
  for (std::size_t i = 0; i < truth.size(); ++i)
    points.push_back({Target::of_point(static_cast<int>(i)), scene.lamps[truth[i]].centre_m});
  const Vector3d at =
      aligned(found->adjustment.network, points).cam_from_world(image).origin_in_source();
  EXPECT_LT((at - made.back().pose.origin_in_source()).norm(), 0.02);
}

void add_corridor(MapSums& sums, const Scene& scene, const std::vector<MadePicture>& made,
                  std::uint64_t seed) {
  SurveyOptions options;
  options.ordered = true;
  options.model_sigma_px = 1e-3;
  const auto found = survey(pictures_of(made), scene.camera, options);
  if (found.ok())
    add(sums, *found, scene, truth_of(*found, made), seed);
  else
    std::cout << "seed " << seed << ": " << found.message << std::endl;
}

TEST(SlowCorridor, PredictsItsErrors) {
  MapSums sums;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const Scene scene = corridor(9);
    add_corridor(sums, scene, walk_along(scene, seed), seed);
  }
  std::cout << "24 corridors: " << sums << std::endl;
  EXPECT_EQ(sums.wrong, 0);
  EXPECT_GE(sums.ok, 22);
  EXPECT_NEAR(sums.chi2 / sums.dof, 1, 0.3);
}

/// Nearly regular distances, and far lamps that are too small for a rim.
TEST(SlowCorridor, RenderedOnesAreNotMappedWrongly) {
  MapSums sums;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    Scene scene = corridor(10);
    scene.sensor.exposure_s = 4e-5;
    for (Lamp& lamp : scene.lamps) {
      lamp.power_w = 1.5;
      lamp.centre_m.x() = 1.4 * lamp.id + random.uniform(-0.2, 0.2);
    }
    std::vector<MadePicture> made;
    constexpr int count = 45;
    for (int i = 0; i < count; ++i) {
      const Vector3d at(9.6 * i / (count - 1), 0.3 * std::sin(i / 5.0),
                        0.3 + 0.02 * random.normal());
      constexpr double tilt_rad = 0.7;
      SimulateOptions options;
      options.seed = static_cast<std::uint64_t>(i);
      MadePicture one;
      one.pose = look_at(at, at + Vector3d(std::sin(tilt_rad), 0, std::cos(tilt_rad)), {0, 1, 0});
      DetectOptions detect_options;
      detect_options.sensor = scene.sensor;
      const Image image = simulate(scene, one.pose, options).image;
      one.picture = {"frame " + std::to_string(i), detect(image.view(), detect_options)};
      one.lamps = lamps_of_blobs(one.picture.blobs, scene, one.pose);
      made.push_back(one);
    }
    add_corridor(sums, scene, made, seed);
  }
  std::cout << "30 rendered corridors: " << sums << std::endl;
  EXPECT_EQ(sums.wrong, 0);
  EXPECT_GE(sums.ok, 24);
}

}  // namespace
}  // namespace occ::test
