// SPDX-License-Identifier: Apache-2.0
// Assignment by blink frequency, and how geometry overrules reflections, misread and missing
// frequencies.
#include "tests/identify/identify_support.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using test::expect_unique_and_right;
using test::View;

Scene coded(Scene scene) {
  for (std::size_t i = 0; i < scene.lamps.size(); ++i)
    scene.lamps[i].frequency_hz = 1000 + 500 * static_cast<double>(i);
  return scene;
}

void read_codes(View& view, const Scene& scene) {
  for (std::size_t i = 0; i < view.blobs.size(); ++i) {
    if (view.lamp[i] < 0) continue;
    view.blobs[i].frequency_hz = *scene.lamps[view.lamp[i]].frequency_hz;
    view.blobs[i].frequency_sigma_hz = 10;
  }
}

// The three coded lamps are matched correctly; a false light may be matched with another lamp.
bool coded_lamps_are_right(const Hypothesis& h, const View& view) {
  return std::count_if(h.matches.begin(), h.matches.end(),
                       [&](const Match& m) { return view.lamp[m.blob] == m.lamp; }) == 3 &&
         test::pose_is_near(h.cam_from_world, view.cam_from_world, 0.3, 0.2);
}

TEST(IdentifyFrequency, CodesIdentifyASquareInOneTry) {
  const Scene scene = coded(test::square_room());
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    View view = test::random_view(scene, random, 4);
    read_codes(view, scene);
    const Result<Identification> found = identify(view.blobs, scene);
    expect_unique_and_right(found, view);
    EXPECT_EQ(found->tried, 1);
    IdentifyOptions ignoring;
    ignoring.use_frequency = false;
    EXPECT_EQ(identify(view.blobs, scene, ignoring)->hypotheses.size(), 4u);
  }
}

TEST(IdentifyFrequency, NearestCodeWithinTheGate) {
  const Scene scene = coded(test::square_room());
  Random random(2);
  View view = test::random_view(scene, random, 4);
  read_codes(view, scene);
  for (Blob& blob : view.blobs) *blob.frequency_hz *= 1.015;  // error of the row clock
  expect_unique_and_right(identify(view.blobs, scene), view);
  for (Blob& blob : view.blobs)
    *blob.frequency_hz *= 1.1;  // beyond every gate: the frequencies are ignored
  EXPECT_EQ(identify(view.blobs, scene)->hypotheses.size(), 4u);
}

TEST(IdentifyFrequency, OneCodeAmongSilentLampsIsEnough) {
  const Scene scene = coded(test::square_room());
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 4);
    read_codes(view, scene);
    for (std::size_t k = 1; k < view.blobs.size(); ++k) view.blobs[k].frequency_hz.reset();
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

// A reflection blinks like its lamp and may be brighter.
TEST(IdentifyFrequency, ReflectionsWithAFrequencyDoNotMislead) {
  const Scene scene = coded(test::irregular_room());
  Random random(4);
  for (int i = 0; i < 40; ++i) {
    View view = test::random_view(scene, random, 5, 0.1);
    test::add_false_lights(view, scene, random, 1);
    read_codes(view, scene);
    view.blobs.back().frequency_hz = view.blobs[1].frequency_hz;
    view.blobs.back().frequency_sigma_hz = 10;
    if (i % 2) view.blobs.back().flux_dn = 1e6;
    test::shuffle(view, random);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(IdentifyFrequency, AMisreadLampStaysUnmatched) {
  const Scene scene = coded(test::irregular_room());
  Random random(5);
  for (int i = 0; i < 40; ++i) {
    View view = test::random_view(scene, random, 6, 0.1);
    read_codes(view, scene);
    const int misread = random.below(6);
    const std::size_t k = misread;
    view.blobs[k].frequency_hz = view.blobs[(k + 1) % 6].frequency_hz;
    view.lamp[k] = -1;
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

// Two poses may fit three coded lamps; the position of a false light does not decide between them.
TEST(IdentifyFrequency, AFalseLightDoesNotOverruleThreeCodes) {
  const Scene scene = coded(test::irregular_room());
  Random random(6);
  IdentifyOptions options;
  options.miss_penalty = 0;  // allows lamps that are switched off
  int held = 0, unique = 0;
  for (int i = 0; i < 200; ++i) {
    View view = test::random_view(scene, random, 5, 0.1);
    while (view.blobs.size() > 3) test::hide(view, 0);
    read_codes(view, scene);
    test::add_false_lights(view, scene, random, 1);
    const Result<Identification> found = identify(view.blobs, scene, options);
    held += std::any_of(found->hypotheses.begin(), found->hypotheses.end(),
                        [&](const Hypothesis& h) { return coded_lamps_are_right(h, view); });
    unique += found.ok();
  }
  EXPECT_GE(held, 195);  // three lamps on the danger cylinder determine the position poorly
  EXPECT_GT(unique, 5);
}

// After three codes are read, a light without a code may be a steady lamp but not a blinking one.
TEST(IdentifyFrequency, ALightWithoutACodeIsNoCodedLamp) {
  Scene scene = coded(test::irregular_room());
  Random random(8);
  View view = test::random_view(scene, random, 6);
  read_codes(view, scene);
  view.blobs[5].frequency_hz.reset();
  const Result<Identification> found = identify(view.blobs, scene);
  ASSERT_EQ(found.status, Status::ok) << found.message;
  EXPECT_EQ(found->hypotheses[0].matches.size(), 5u);
  scene.lamps[view.lamp[5]].frequency_hz.reset();
  expect_unique_and_right(identify(view.blobs, scene), view);
}

TEST(IdentifyFrequency, LampsThatShareACodeAreDistinguishedByGeometry) {
  Scene scene = coded(test::irregular_room());
  for (std::size_t i = 0; i < scene.lamps.size(); ++i)
    scene.lamps[i].frequency_hz = i % 2 ? 1000 : 2000;
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    View view = test::random_view(scene, random, 5);
    read_codes(view, scene);
    expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(IdentifyByCode, IdsIdentifyTheBlobsOfASquare) {
  const Scene scene = test::square_room();
  Random random(31);
  for (int i = 0; i < 20; ++i) {
    test::View view = test::random_view(scene, random, 4);
    for (std::size_t k = 0; k < 4; ++k) view.blobs[k].lamp_id = scene.lamps[view.lamp[k]].id;
    test::expect_unique_and_right(identify(view.blobs, scene), view);
  }
}

TEST(IdentifyByCode, ALightWithAnUnknownIdIsNoLamp) {
  const Scene scene = test::square_room();
  Random random(32);
  test::View view = test::random_view(scene, random, 4);
  view.blobs[1].lamp_id = 77;
  const Result<Identification> found = identify(view.blobs, scene);
  for (const Hypothesis& hypothesis : found->hypotheses)
    for (const Match& match : hypothesis.matches) EXPECT_NE(match.blob, 1);
}

}  // namespace
}  // namespace occ
