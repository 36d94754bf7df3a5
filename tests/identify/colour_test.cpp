// SPDX-License-Identifier: Apache-2.0
// Colours of lamps and blobs in identification.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "libocc/identify/internal/assignment_problem.hpp"
#include "tests/identify/identify_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using internal::identify::make_problem;
using test::add_false_lights;
using test::see;
using test::View;

const Eigen::Vector3d white(1, 1, 1), green(0.05, 1, 0.6), red(1, 0.1, 0.05);

BlobColour seen(const Eigen::Vector3d& colour) {
  return {colour / colour.sum(), Eigen::Vector3d::Constant(0.01), {}};
}

Scene coloured_room(const Eigen::Vector3d& colour) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.colour = colour;
  return scene;
}

/// The room's lamps in their colours, among white lights.
View among_white_lights(const Scene& scene, Random& random, int lights) {
  View view = see(scene, test::random_room_pose(random, 0.1), random, 0.1);
  add_false_lights(view, scene, random, lights);
  for (std::size_t i = 0; i < view.blobs.size(); ++i)
    view.blobs[i].colour = seen(view.lamp[i] < 0 ? white : scene.lamps[view.lamp[i]].colour);
  return view;
}

TEST(IdentifyColour, WhiteLightsAreNoCandidates) {
  const Scene scene = coloured_room(green);
  Random random(1);
  for (int trial = 0; trial < 10; ++trial) {
    View view = among_white_lights(scene, random, 30);
    const Result<Identification> found = identify(view.blobs, scene);
    ASSERT_EQ(found.status, Status::ok) << found.message;
    EXPECT_TRUE(test::assignment_is_right(found->hypotheses.front(), view));
    EXPECT_EQ(found.message, "");

    // These lights change nothing.
    std::vector<Blob> lamps;
    for (std::size_t i = 0; i < view.blobs.size(); ++i)
      if (view.lamp[i] >= 0) lamps.push_back(view.blobs[i]);
    EXPECT_EQ(identify(lamps, scene)->risk, found->risk);
    for (Blob& blob : view.blobs) blob.colour.reset();
    EXPECT_GT(identify(view.blobs, scene)->risk, found->risk);
  }
}

// A square of which two neighbouring lamps are red has one pose only.
TEST(IdentifyColour, ColoursBreakASymmetry) {
  Scene scene = test::square_room();
  Random random(2);
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->height_m = 0.5;
  options.prior->height_sigma_m = 0.2;
  const View plain = see(scene, look_at({2, 2, 0.5}, {2, 2, 3}, {0, 1, 0}), random, 0.1);
  EXPECT_EQ(identify(plain.blobs, scene, options)->hypotheses.size(), 4u);
  scene.lamps[0].colour = scene.lamps[1].colour = red;
  View view = plain;
  for (std::size_t i = 0; i < view.blobs.size(); ++i)
    view.blobs[i].colour = seen(scene.lamps[view.lamp[i]].colour);
  const Result<Identification> found = identify(view.blobs, scene, options);
  ASSERT_EQ(found->hypotheses.size(), 1u) << found.message;
  EXPECT_TRUE(test::assignment_is_right(found->hypotheses.front(), view));
}

TEST(IdentifyColour, CutAndMergedBlobsOfOtherColoursExplainNothing) {
  const Scene scene = coloured_room(green);
  Random random(3);
  View view = among_white_lights(scene, random, 4);
  for (std::size_t i = 0; i < view.blobs.size(); ++i) view.blobs[i].merged = view.lamp[i] < 0;
  const IdentifyOptions options;
  EXPECT_TRUE(make_problem(view.blobs, scene, options).partial_blobs.empty());
  for (Blob& blob : view.blobs) blob.colour.reset();
  EXPECT_EQ(make_problem(view.blobs, scene, options).partial_blobs.size(), 4u);
}

// White lamps state their colour as soon as one lamp has another.
TEST(IdentifyColour, WhiteLampsStateWhiteInAColouredScene) {
  Scene scene = test::irregular_room();
  Random random(4);
  View view = among_white_lights(scene, random, 0);
  view.blobs.front().colour = seen(green);
  const IdentifyOptions options;
  EXPECT_EQ(make_problem(view.blobs, scene, options).observations.size(), view.blobs.size());
  scene.lamps.back().colour = red;
  EXPECT_EQ(make_problem(view.blobs, scene, options).observations.size(), view.blobs.size() - 1);
}

TEST(IdentifyColour, AGreyImageWorksAsBeforeAndIsReported) {
  const Scene scene = coloured_room(green);
  Random random(5);
  View view = among_white_lights(scene, random, 2);
  for (Blob& blob : view.blobs) blob.colour.reset();
  const Result<Identification> found = identify(view.blobs, scene);
  const Result<Identification> plain = identify(view.blobs, test::irregular_room());
  EXPECT_EQ(found.status, plain.status);
  EXPECT_EQ(found->risk, plain->risk);
  EXPECT_EQ(plain.message.find("colours"), std::string::npos);
  EXPECT_NE(found.message.find("colours of the lamps were not compared"), std::string::npos);
}

// A code that is read names the lamp, but a blob of another colour is not that lamp.
TEST(IdentifyColour, CodesDoNotOverrideColours) {
  const Scene scene = coloured_room(green);
  Random random(6);
  View view = among_white_lights(scene, random, 0);
  view.blobs.front().lamp_id = view.lamp.front();
  const IdentifyOptions options;
  EXPECT_TRUE(make_problem(view.blobs, scene, options).observations.front().coded);
  view.blobs.front().colour = seen(white);
  const auto problem = make_problem(view.blobs, scene, options);
  EXPECT_EQ(problem.observations.size(), view.blobs.size() - 1);
  EXPECT_TRUE(problem.foreign.front());
}

}  // namespace
}  // namespace occ
