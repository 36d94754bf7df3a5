// SPDX-License-Identifier: Apache-2.0
// Monte Carlo over rooms, poses, hidden lamps and false lights: a pose reported as unique is
// correct.
#include "tests/identify/identify_support.hpp"
#include "tests/identify/random_maps.hpp"

namespace occ {
namespace {

using test::View;

struct Tally {
  int unique = 0, wrong = 0, lost = 0;  // lost: no hypothesis is correct
};

// Views show at least `min_lamps` lamps, of which one may be hidden.
Tally run(int trials, int lamps, int min_lamps, int false_lights, std::uint64_t seed) {
  Tally tally;
  Random random(seed);
  for (int i = 0; i < trials; ++i) {
    const Scene scene = test::random_room(random, lamps, i % 3 ? 3 : 2.5);
    View view = test::random_view(scene, random, min_lamps, random.uniform(0.02, 0.4));
    if (static_cast<int>(view.blobs.size()) > min_lamps) test::hide(view, random.below(min_lamps));
    test::add_false_lights(view, scene, random, false_lights);
    test::shuffle(view, random);
    const Result<Identification> found = identify(view.blobs, scene);
    const bool right =
        std::any_of(found->hypotheses.begin(), found->hypotheses.end(),
                    [&](const Hypothesis& h) { return test::assignment_is_right(h, view); });
    tally.unique += found.ok();
    tally.wrong += found.ok() && !right;
    tally.lost += !right;
  }
  return tally;
}

TEST(IdentifyChance, NoWrongPoseIsDeclaredUnique) {
  const Tally few = run(150, 5, 4, 0, 1);
  EXPECT_EQ(few.wrong, 0);
  EXPECT_LE(few.lost, 2);
  const Tally many = run(100, 6, 5, 0, 2);
  EXPECT_EQ(many.wrong, 0);
  EXPECT_EQ(many.lost, 0);
  EXPECT_GE(many.unique, 99);
}

TEST(SlowIdentifyChance, NoWrongPoseIsDeclaredUnique) {
  const Tally bare = run(500, 6, 4, 0, 3);
  EXPECT_EQ(bare.wrong, 0);
  EXPECT_LE(bare.lost, 5);
  const Tally lit = run(500, 6, 5, 2, 4);
  EXPECT_EQ(lit.wrong, 0);
  EXPECT_LE(lit.lost, 5);
  EXPECT_GE(lit.unique, 450);
}

// Six lights that are not lamps of the map: some pose often matches four of them.
TEST(IdentifyChance, RandomLightsAreNotAUniqueMap) {
  Random random(5);
  int explained = 0;
  for (int i = 0; i < 40; ++i) {
    const Scene scene = test::random_room(random, 6);
    View view;
    test::add_false_lights(view, scene, random, 6);
    const Result<Identification> found = identify(view.blobs, scene);
    EXPECT_FALSE(found.ok());
    explained += !found->hypotheses.empty();
    EXPECT_TRUE(found->hypotheses.size() != 1 || found->chance > 0.1) << found->chance;
  }
  EXPECT_GT(explained, 20);
}

// Few false lights in large maps, where some pose matches all of them; with and without gravity.
TEST(IdentifyChance, FalseLightsAloneAreRarelyMatched) {
  int unique = 0, images = 0;
  for (const bool upright : {false, true})
    for (const int lamps : {5, 8, 20})
      for (const int lights : {4, 5, 8}) {
        Random random(static_cast<std::uint64_t>(100 * lamps + lights));
        for (int i = 0; i < 20; ++i, ++images) {
          maps::Options options;
          options.lamps = lamps;
          maps::View view{
              maps::random_scene(random, options), maps::random_pose(random, options), {}, {}};
          for (int k = 0; k < lights; ++k)
            view.blobs.push_back(maps::spot({random.uniform(0, 639), random.uniform(0, 479)}, 0.5));
          IdentifyOptions identify_options;
          if (upright) identify_options.prior = maps::gravity(view, 0.01, random);
          const Result<Identification> found = identify(view.blobs, view.scene, identify_options);
          unique += found.ok();
          EXPECT_EQ(found.ok(), found->risk <= IdentifyOptions{}.max_risk);
        }
      }
  EXPECT_LE(unique, images / 100);
}

TEST(IdentifyChance, IsSmallWhenManyLampsAgree) {
  Random random(6);
  for (int i = 0; i < 20; ++i) {
    const Scene scene = test::random_room(random, 6);
    View view = test::random_view(scene, random, 6, 0.1);
    test::add_false_lights(view, scene, random, 1);
    EXPECT_LT(identify(view.blobs, scene)->chance, 1e-2);
  }
}

}  // namespace
}  // namespace occ
