// SPDX-License-Identifier: Apache-2.0
// Lamps on one line, such as those of a corridor. Their centres leave a rotation about the line
// open in each picture and in the map; their rims determine it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

/// Lamps on a line, at uneven distances or all at 1.5 m.
Scene corridor(int count, double radius_m, bool is_regular = false) {
  constexpr double steps_m[] = {1.3, 1.8, 1.5, 1.9, 1.2, 1.6};
  std::vector<Vector3d> lamps;
  double x = 0;
  for (int i = 0; i < count; ++i) {
    lamps.push_back({x, 0, 2.7});
    x += is_regular ? 1.5 : steps_m[i % 6];
  }
  Scene scene = room_of(lamps);
  scene.camera = Camera::pinhole(1280, 960, 600, 600, 639.5, 479.5);
  for (Lamp& lamp : scene.lamps) lamp.radius_m = radius_m;
  return scene;
}

/// Pictures along the corridor.
std::vector<MadePicture> walk_along(const Scene& scene, int count, std::uint64_t seed,
                                    double noise_px = 0.03) {
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

void check_corridor(bool ordered, std::uint64_t seed, bool is_regular = false) {
  const double radius_m = 0.12;
  const Scene scene = corridor(9, radius_m, is_regular);
  const auto made = walk_along(scene, 50, seed);
  SurveyOptions options;
  options.ordered = ordered;
  options.radius_m = radius_m;
  options.radius_sigma = 1e-4;
  const auto found = survey(pictures_of(made), scene.camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  const std::vector<int> truth = truth_of(*found, made);
  EXPECT_GE(truth.size(), 8u);
  EXPECT_LT(worst_distance_m(*found, scene, truth), 0.05);  // of 12 m
  for (const SurveyedLamp& lamp : found->lamps) {
    EXPECT_LT(std::acos(-lamp.lamp.normal.z()), 0.02);  // z is up
    EXPECT_NEAR(lamp.lamp.radius_m, radius_m, 0.02 * radius_m);
  }
}

TEST(Corridor, IsMappedByRims) {
  for (const bool ordered : {true, false}) {
    SCOPED_TRACE(ordered);
    check_corridor(ordered, 3);
  }
}

TEST(Corridor, ARegularOneIsMappedFromAVideo) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) check_corridor(true, seed, true);
}

TEST(Corridor, OfSmallLampsIsRefused) {
  const Scene scene = corridor(9, 0.12);
  auto made = walk_along(scene, 50, 3);
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

TEST(SlowCorridor, PredictsItsErrors) {
  double sum = 0, worst_m = 0;
  int total = 0, refused = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const Scene scene = corridor(9, 0.12);
    const auto made = walk_along(scene, 50, seed);
    SurveyOptions options;
    options.ordered = seed % 2 == 0;
    options.model_sigma_px = 1e-3;
    options.radius_m = 0.12;
    const auto found = survey(pictures_of(made), scene.camera, options);
    if (!found.ok()) {
      ++refused;
      EXPECT_FALSE(options.ordered) << found.message;
      std::printf("seed %d: %s\n", static_cast<int>(seed), found.message.c_str());
      continue;
    }
    int dof = 0;
    const std::vector<int> truth = truth_of(*found, made);
    sum += shape_chi2(*found, scene, truth, dof);
    total += dof;
    worst_m = std::max(worst_m, worst_distance_m(*found, scene, truth));
  }
  std::printf("squared errors over variances %.2f, worst distance %.1f mm\n", sum / total,
              1e3 * worst_m);
  EXPECT_NEAR(sum / total, 1, 0.3);
  EXPECT_LE(refused, 3);
}

}  // namespace
}  // namespace occ::test
