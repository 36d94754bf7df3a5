// SPDX-License-Identifier: Apache-2.0
// Limits of identification: lamps that are nearly on a line, and a search without any time.
#include <gtest/gtest.h>

#include <chrono>

#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/lamp_index.hpp"
#include "tests/identify/identify_support.hpp"
#include "tests/identify/random_maps.hpp"

namespace occ {
namespace {

using internal::identify::make_problem;
using internal::identify::solve_assignment;

/// Five lamps on an oblique line, one of them beside it by `off` of their distance of 1 m.
Scene nearly_straight(double off) {
  Scene scene = test::irregular_room();
  scene.lamps.clear();
  const Eigen::Vector3d along = Eigen::Vector3d(1, 0.3, 0.1).normalized();
  for (int i = 0; i < 5; ++i)
    scene.lamps.push_back(test::disc_lamp(i, Eigen::Vector3d(1, 1.5, 2.7) + 0.5 * i * along));
  scene.lamps[3].centre_m += off * Eigen::Vector3d(0.3, -1, 0).normalized();
  return scene;
}

TEST(IdentifyBoundary, LampsOnALineToRoundingAreDegenerate) {
  Random random(1);
  for (const double off : {0.0, 1e-11, 1e-7}) {
    const Scene scene = nearly_straight(off);
    const test::View view = test::see(scene, test::upright({2, 1.5, 0}, 0), random, 0.1);
    const Result<Identification> found = identify(view.blobs, scene);
    const bool is_named =
        found.message.find("the scene's lamps are collinear") != std::string::npos;
    EXPECT_EQ(is_named, off < 1e-9) << off << ' ' << found.message;
    EXPECT_TRUE(!is_named || found.status == Status::degenerate);
  }
}

TEST(IdentifyBoundary, AnIndexIsOfTheSameLampsOnly) {
  Random random(3);
  const maps::View view = maps::random_view(random, maps::Options{});
  IdentifyOptions options;
  options.index = LampIndex(view.scene.lamps);
  EXPECT_EQ(test::complaint([&] { identify(view.blobs, view.scene, options); }), "");
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Scene moved = view.scene;
    moved.lamps[3].centre_m[axis] += 1e-9;
    const std::string text = test::complaint([&] { identify(view.blobs, moved, options); });
    EXPECT_NE(text.find("index"), std::string::npos) << axis;
  }
  Scene fewer = view.scene, more = view.scene;
  fewer.lamps.pop_back();
  more.lamps.push_back(test::disc_lamp(99, {1, 1, 3}));
  for (const Scene& other : {fewer, more})
    EXPECT_NE(test::complaint([&] { identify(view.blobs, other, options); }), "");
}

// At the deadline no method begins another group of blobs.
TEST(IdentifyBoundary, ASearchWithoutTimeVerifiesNothing) {
  Random random(2);
  maps::Options map;
  map.lamps = 12;
  map.thickness_m = 0;
  const maps::View view = maps::random_view(random, map);
  IdentifyOptions options;
  options.model_sigma_px = 0.1;
  options.index = LampIndex(view.scene.lamps);
  for (const bool upright : {false, true}) {
    if (upright) options.prior = maps::gravity(view, 0.01, random);
    for (const IdentifyMethod method :
         {IdentifyMethod::automatic, IdentifyMethod::alignment, IdentifyMethod::voting,
          IdentifyMethod::ransac, IdentifyMethod::clustering, IdentifyMethod::hashing}) {
      options.method = method;
      auto problem = make_problem(view.blobs, view.scene, options);
      ASSERT_FALSE(solve_assignment(problem)->hypotheses.empty());
      problem.deadline = std::chrono::steady_clock::time_point::min();
      const Result<Identification> found = solve_assignment(problem);
      EXPECT_TRUE(found->hypotheses.empty());
      EXPECT_TRUE(found->cut_short);
      EXPECT_EQ(found->tried, 0) << static_cast<int>(method);
      EXPECT_GT(found->untried, 0.99);
    }
  }
}

}  // namespace
}  // namespace occ
