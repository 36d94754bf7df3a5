// SPDX-License-Identifier: Apache-2.0
// Limits of the search: a search that is cut short states it. Sizes exclude only wrong assignments.
#include <cmath>

#include "libocc/identify/internal/size_consistency.hpp"
#include "tests/identify/identify_support.hpp"
#include "tests/identify/random_maps.hpp"

namespace occ {
namespace {

using test::View;

struct HardView {
  Scene scene;
  View view;
};

HardView hard_view(std::uint64_t seed) {
  Random random(seed);
  HardView hard{test::random_room(random, 6), {}};
  hard.view = test::random_view(hard.scene, random, 5, 0.3);
  test::add_false_lights(hard.view, hard.scene, random, 40);
  test::shuffle(hard.view, random);
  return hard;
}

TEST(IdentifyLimits, ASearchOutOfTimeStatesIt) {
  const HardView hard = hard_view(1);
  IdentifyOptions options;
  options.max_time_s = 1e-4;
  for (const IdentifyMethod method : {IdentifyMethod::alignment, IdentifyMethod::voting,
                                      IdentifyMethod::ransac, IdentifyMethod::clustering}) {
    options.method = method;
    const Result<Identification> found = identify(hard.view.blobs, hard.scene, options);
    EXPECT_TRUE(found->cut_short);
    EXPECT_GT(found->untried, 0);
    EXPECT_LE(found->untried, 1);
    if (found.status != Status::degenerate) {
      EXPECT_NE(found.message.find("max_time_s"), std::string::npos) << found.message;
    }
  }
  for (const double wrong : {0.0, -1.0, std::nan("")}) {
    options.max_time_s = wrong;
    EXPECT_THROW(options.validate(), std::invalid_argument) << wrong;
  }
}

TEST(IdentifyLimits, ACompleteSearchHasNothingUntried) {
  for (const int lamps : {4, 5, 6}) {
    Random random(2);
    const Scene scene = test::random_room(random, 6);
    const View view = test::random_view(scene, random, lamps, 0.1);
    IdentifyOptions options;
    for (const IdentifyMethod method :
         {IdentifyMethod::automatic, IdentifyMethod::alignment, IdentifyMethod::voting,
          IdentifyMethod::ransac, IdentifyMethod::clustering}) {
      options.method = method;
      const Result<Identification> found = identify(view.blobs, scene, options);
      EXPECT_FALSE(found->cut_short);
      EXPECT_EQ(found->untried, 0);
      EXPECT_TRUE(test::holds_truth(found.value, view)) << lamps;
      EXPECT_GT(found->tried, 0);
    }
  }
}

// Sizes with errors of 10 %; the sizes of saturated blobs are too large, others are unknown.
TEST(IdentifyLimits, SizesPermitTheRightAssignment) {
  int wrong = 0, excluded = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    Scene scene = test::random_room(random, 6);
    for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.085, lamp.shape = LampShape::disc;
    View view = test::random_view(scene, random, 5, 0.3);
    for (std::size_t i = 0; i < view.blobs.size(); ++i) {
      Blob& blob = view.blobs[i];
      const double distance_m = (view.cam_from_world * scene.lamps[view.lamp[i]].centre_m).norm();
      const int kind = random.below(3);
      const double radius_px = scene.camera.fx_px() * 0.085 / distance_m *
                                   (1 + 0.1 * std::clamp(random.normal(), -2.0, 2.0)) +
                               (kind == 1 ? 4 : 0);
      blob.ellipse.semi_major_px = blob.ellipse.semi_minor_px = radius_px;
      blob.saturated = kind == 1;
      if (kind != 2) blob.rim = {RimPoint{blob.centroid_px, {1, 0}, 0.1}};
    }
    const IdentifyOptions options;
    const auto problem = internal::identify::make_problem(view.blobs, scene, options);
    internal::identify::SizeConsistency sizes(problem);
    const int blobs = static_cast<int>(problem.observations.size());
    for (int i = 0; i < blobs; ++i)
      for (int j = 0; j < blobs; ++j) {
        if (i == j) continue;
        const int a = view.lamp[problem.observation(i).blob];
        const int b = view.lamp[problem.observation(j).blob];
        EXPECT_TRUE(sizes.permits({i, a}, {j, b})) << seed;
        for (int c = 0; c < 6; ++c) {
          if (c == b || c == a) continue;
          ++wrong;
          excluded += !sizes.permits({i, a}, {j, c});
        }
      }
  }
  EXPECT_GT(excluded, wrong / 20);
}

}  // namespace
}  // namespace occ
