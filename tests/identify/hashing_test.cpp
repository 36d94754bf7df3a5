// SPDX-License-Identifier: Apache-2.0
// Hashing by triangle shape: as reliable as voting; voting is used where hashing does not apply.
#include <gtest/gtest.h>

#include <algorithm>

#include "libocc/identify/lamp_index.hpp"
#include "tests/identify/random_maps.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;

constexpr double half_a_degree = 0.00873;

struct Tally {
  int right = 0, listed = 0, wrong = 0;
};

Tally run(int lamps, int count, double thickness_m, double gravity_sigma_rad = half_a_degree) {
  maps::Options options;
  options.lamps = lamps;
  options.thickness_m = thickness_m;
  IdentifyOptions by;
  by.method = IdentifyMethod::hashing;
  by.model_sigma_px = 0.1;
  Random random(static_cast<std::uint64_t>(lamps) + 1);
  Tally tally;
  for (int i = 0; i < count; ++i) {
    const maps::View view = maps::random_view(random, options);
    by.prior = maps::gravity(view, gravity_sigma_rad, random);
    by.index = LampIndex(view.scene.lamps);
    const Result<Identification> found = identify(view.blobs, view.scene, by);
    const auto right = [&](const Hypothesis& h) { return maps::is_right(h, view); };
    if (found.ok())
      ++(right(found->hypotheses.front()) ? tally.right : tally.wrong);
    else
      tally.listed += std::any_of(found->hypotheses.begin(), found->hypotheses.end(), right);
  }
  return tally;
}

void expect_found(int lamps, int count, double thickness_m, double unique = 0.97) {
  SCOPED_TRACE(lamps);
  const Tally tally = run(lamps, count, thickness_m);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right + tally.listed, 0.995 * count);
  EXPECT_GE(tally.right, unique * count) << tally.listed;
}

TEST(IdentifyHashing, FindsThePoseInOnePlane) {
  for (const int lamps : {8, 20, 100, 400}) expect_found(lamps, 50, 0);
}

TEST(IdentifyHashing, FindsThePoseWhereHeightsAreAMillimetreOff) { expect_found(100, 50, 0.002); }

TEST(IdentifyHashing, VotesWhereLampsHangAtAllHeights) { expect_found(50, 30, 0.5); }

TEST(SlowIdentifyHashing, FindsThePose) {
  for (const int lamps : {20, 100}) expect_found(lamps, 2000, 0);
  // With many lamps more answers are ambiguous: rivals with a sixth fewer pairs are listed as well.
  expect_found(1000, 200, 0, 0.95);
  expect_found(10000, 10, 0, 0.8);
}

TEST(IdentifyHashing, NeedsGravity) {
  maps::Options options;
  options.thickness_m = 0;
  Random random(2);
  const maps::View view = maps::random_view(random, options);
  IdentifyOptions by;
  by.model_sigma_px = 0.1;
  const Result<Identification> voted = identify(view.blobs, view.scene, by);
  by.method = IdentifyMethod::hashing;
  const Result<Identification> found = identify(view.blobs, view.scene, by);
  ASSERT_EQ(found->hypotheses.size(), voted->hypotheses.size());
  EXPECT_EQ(found->tried, voted->tried);
}

TEST(IdentifyHashing, AppliesToLampsOfOneHeightOnly) {
  Random random(3);
  maps::Options options;
  options.lamps = 100;
  EXPECT_FALSE(LampIndex(maps::random_scene(random, options).lamps).applies());
  options.thickness_m = 0;
  Scene scene = maps::random_scene(random, options);
  for (std::size_t i = 0; i < 15; ++i) scene.lamps[i].centre_m.z() = 2.5;
  const LampIndex most(scene.lamps);
  EXPECT_TRUE(most.applies());
  EXPECT_GT(most.triangles(), 85u * 20);
  for (std::size_t i = 15; i < 30; ++i) scene.lamps[i].centre_m.z() = 2.5;
  EXPECT_FALSE(LampIndex(scene.lamps).applies());
  EXPECT_FALSE(LampIndex({}).applies());
}

// "Within 2 cm of one height": the documented limits of height and share.
TEST(IdentifyHashing, AppliesWithinTwoCentimetresForFourFifthsOfTheLamps) {
  std::vector<Lamp> lamps = maps::grid(5).lamps;
  const auto with_heights = [&](double apart_m, std::size_t below) {
    std::vector<Lamp> changed = lamps;
    for (std::size_t i = 0; i < changed.size(); ++i)
      changed[i].centre_m.z() -= i < below ? 0.5 : i % 2 ? apart_m : 0;
    return LampIndex(changed);
  };
  EXPECT_TRUE(with_heights(0.018, 0).applies());
  EXPECT_FALSE(with_heights(0.023, 0).applies());
  EXPECT_TRUE(with_heights(0, 5).applies());
  EXPECT_FALSE(with_heights(0, 6).applies());
  lamps.resize(4);
  EXPECT_TRUE(with_heights(0.018, 0).applies());
  lamps.resize(3);
  EXPECT_FALSE(with_heights(0, 0).applies());
  // All four lamps of a square with its neighbours: four triangles.
  lamps = maps::grid(2).lamps;
  EXPECT_EQ(with_heights(0, 0).triangles(), 4u);
}

// Lamps below the common height are in no triangle, but are assigned.
TEST(IdentifyHashing, LampsOfOtherHeightsAreMatched) {
  Random random(4);
  maps::Options options;
  options.lamps = 60;
  options.thickness_m = 0;
  int named = 0, right = 0;
  for (int i = 0; i < 30; ++i) {
    Scene scene = maps::random_scene(random, options);
    for (std::size_t k = 0; k < 9; ++k) scene.lamps[k].centre_m.z() = 2.4;
    std::optional<maps::View> view;
    while (!view) view = maps::see(scene, maps::random_pose(random, options), random, options);
    IdentifyOptions by;
    by.method = IdentifyMethod::hashing;
    by.model_sigma_px = 0.1;
    by.prior = maps::gravity(*view, half_a_degree, random);
    const Result<Identification> found = identify(view->blobs, scene, by);
    if (!found.ok()) continue;
    right += maps::is_right(found->hypotheses.front(), *view);
    for (const Match& match : found->hypotheses.front().matches) named += match.lamp < 9;
  }
  EXPECT_GE(right, 28);
  EXPECT_GT(named, 5);
}

TEST(IdentifyHashing, AGridStaysAmbiguous) {
  constexpr int side = 12;
  const Scene scene = maps::grid(side);
  const Vector3d eye(3.9, 4.1, 0.6);
  const Rigid3 pose = look_at(eye, eye + Vector3d(0.1, 0, 1), Vector3d::UnitY());
  std::vector<Blob> blobs;
  for (const Lamp& lamp : scene.lamps)
    if (const auto px = scene.camera.project(pose * lamp.centre_m))
      if (scene.camera.contains(*px)) blobs.push_back(maps::spot(*px, 0.1));
  ASSERT_GE(blobs.size(), 6u);
  IdentifyOptions by;
  by.prior = Prior{};
  by.prior->gravity_in_cam = -pose.rotation.col(2);
  const Result<Identification> voted = identify(blobs, scene, by);
  by.method = IdentifyMethod::hashing;
  const Result<Identification> found = identify(blobs, scene, by);
  EXPECT_EQ(found.status, Status::ambiguous);
  EXPECT_EQ(found->hypotheses.size(), voted->hypotheses.size());
  EXPECT_GE(found->hypotheses.size(), 4u);
}

TEST(IdentifyHashing, AnIndexOfAnotherMapIsRefused) {
  maps::Options options;
  Random random(5);
  const maps::View view = maps::random_view(random, options);
  IdentifyOptions by;
  by.index = LampIndex(maps::random_scene(random, options).lamps);
  EXPECT_EQ(test::complaint([&] { identify(view.blobs, view.scene, by); }).find("index must be"),
            0u);
}

}  // namespace
}  // namespace occ
