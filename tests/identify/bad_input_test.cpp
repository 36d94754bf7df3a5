// SPDX-License-Identifier: Apache-2.0
// Bad input to identification ends in a clear status or error: maps with duplicate lamps or codes,
// no blobs, thousands of blobs, contradictory priors.
#include "tests/identify/identify_support.hpp"
#include "tests/identify/random_maps.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using test::View;

constexpr double half_a_degree = 0.00873;

TEST(IdentifyBadInput, NoBlobsAreTooFew) {
  const Result<Identification> found = identify({}, test::irregular_room());
  EXPECT_EQ(found.status, Status::too_few_lamps);
  EXPECT_NE(found.message.find("0 blobs"), std::string::npos) << found.message;
}

// A map with every lamp twice gives the same pose, assigned to the first of each two lamps.
TEST(IdentifyBadInput, LampsThatTheMapHasTwiceAreTheFirst) {
  Random random(1);
  for (const IdentifyMethod method :
       {IdentifyMethod::alignment, IdentifyMethod::voting, IdentifyMethod::hashing}) {
    maps::Options options;
    options.thickness_m = 0;
    for (int i = 0; i < 5; ++i) {
      const maps::View view = maps::random_view(random, options);
      Scene twice = view.scene;
      for (Lamp lamp : view.scene.lamps) {
        lamp.id += 100;
        twice.lamps.push_back(lamp);
      }
      IdentifyOptions by;
      by.method = method;
      by.model_sigma_px = 0.1;
      by.prior = maps::gravity(view, half_a_degree, random);
      const Result<Identification> found = identify(view.blobs, twice, by);
      ASSERT_TRUE(found.ok()) << static_cast<int>(method) << found.message;
      EXPECT_TRUE(maps::is_right(found->hypotheses.front(), view));
    }
  }
}

TEST(IdentifyBadInput, OneLampTwiceIsNoSecondLight) {
  Scene scene = test::irregular_room();
  scene.lamps.push_back(scene.lamps[2]);
  scene.lamps.back().id = 77;
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    View view;
    do {
      view = test::random_view(scene, random, 6);
      for (std::size_t k = 0; k < view.lamp.size(); ++k)
        if (view.lamp[k] == static_cast<int>(scene.lamps.size()) - 1) {
          test::hide(view, static_cast<int>(k));
          break;
        }
    } while (view.blobs.size() < 5);
    test::expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(IdentifyBadInput, AllLampsInOnePlaceAreDegenerate) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.centre_m = {2, 2, 3};
  const std::vector<Blob> blobs{test::spot({300, 200}, 0.1, 1e4), test::spot({320, 260}, 0.1, 1e4),
                                test::spot({250, 300}, 0.1, 1e4), test::spot({350, 310}, 0.1, 1e4)};
  EXPECT_EQ(identify(blobs, scene).status, Status::degenerate);
}

// Two lamps blink at the same frequency; geometry distinguishes them.
TEST(IdentifyBadInput, ACodeOfTwoLampsIdentifiesNeither) {
  Scene scene = test::irregular_room();
  for (std::size_t i = 0; i < scene.lamps.size(); ++i)
    scene.lamps[i].frequency_hz = 1000.0 * static_cast<double>(1 + i / 2);
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 6);
    for (std::size_t k = 0; k < view.blobs.size(); ++k) {
      view.blobs[k].frequency_hz = *scene.lamps[view.lamp[k]].frequency_hz;
      view.blobs[k].frequency_sigma_hz = 1;
    }
    test::expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

// A reflection transmits its lamp's id as well.
TEST(IdentifyBadInput, TwoBlobsWithOneIdAreOneLampAndAFalseLight) {
  const Scene scene = test::irregular_room();
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 6);
    for (std::size_t k = 0; k < view.blobs.size(); ++k)
      view.blobs[k].lamp_id = scene.lamps[view.lamp[k]].id;
    test::add_false_lights(view, scene, random, 1);
    view.blobs.back().lamp_id = view.blobs.front().lamp_id;
    test::shuffle(view, random);
    test::expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(IdentifyBadInput, AStarrySkyEndsInBoundedWork) {
  Random random(5);
  for (const int lamps : {6, 100}) {
    maps::Options options;
    options.lamps = lamps;
    options.visible = lamps == 6 ? 4 : 6;
    options.thickness_m = 0;
    maps::View view = maps::random_view(random, options);
    for (int i = 0; i < 10000; ++i)
      view.blobs.push_back(maps::spot({random.uniform(0, 639), random.uniform(0, 479)}, 0.5));
    for (const IdentifyMethod method : {IdentifyMethod::automatic, IdentifyMethod::hashing}) {
      IdentifyOptions by;
      by.method = method;
      by.prior = maps::gravity(view, half_a_degree, random);
      by.max_hypotheses = 20000;
      const Result<Identification> found = identify(view.blobs, view.scene, by);
      EXPECT_FALSE(found.ok());
      EXPECT_FALSE(found.message.empty());
      EXPECT_LT(found->tried, 10 * by.max_hypotheses);
    }
  }
}

TEST(IdentifyBadInput, PriorsThatContradictEachOtherAreRefused) {
  const Scene scene = test::irregular_room();
  Random random(6);
  const View view = test::random_view(scene, random, 6);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->last_pose = PriorPose{view.cam_from_world, 1e-4 * Matrix6::Identity()};
  test::expect_unique_and_right(identify(view.blobs, scene, options), view);
  options.prior->position_m = view.cam_from_world.origin_in_source() + Vector3d(0, 8, 0);
  const std::string said = test::complaint([&] { identify(view.blobs, scene, options); });
  EXPECT_NE(said.find("prior.position_m and prior.last_pose contradict"), std::string::npos)
      << said;
}

// A merged blob is used like a whole one only if a prior can confirm the result.
TEST(IdentifyBadInput, AnEmptyPriorChangesNothing) {
  const Scene scene = test::irregular_room();
  Random random(7);
  for (int i = 0; i < 10; ++i) {
    View view = test::random_view(scene, random, 4);
    view.blobs.resize(4);
    view.blobs[0].merged = view.blobs[1].merged = true;
    IdentifyOptions empty;
    empty.prior = Prior{};
    const Result<Identification> without = identify(view.blobs, scene);
    const Result<Identification> with = identify(view.blobs, scene, empty);
    EXPECT_EQ(without.status, Status::too_few_lamps);
    EXPECT_EQ(with.status, without.status) << with.message;
    EXPECT_EQ(with.message, without.message);
    EXPECT_EQ(with->hypotheses.size(), without->hypotheses.size());
  }
}

}  // namespace
}  // namespace occ
