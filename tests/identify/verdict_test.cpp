// SPDX-License-Identifier: Apache-2.0
// Verdicts of identify() and recognise(): probabilities and risk are those of a right answer, over
// random maps, grids, false lights, dark lamps, wrong priors and objects.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/recognise.hpp"
#include "tests/identify/random_maps.hpp"
#include "tests/support/random_objects.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using maps::View;

/// A result: its stated risk, and if its first pose is right.
struct Stated {
  double risk = 1;
  bool right = false;
};

using Campaign = std::vector<Stated>;

bool verdict_is_near(const Hypothesis& hypothesis, const Rigid3& truth) {
  const Rigid3& pose = hypothesis.cam_from_world;
  return (pose.origin_in_source() - truth.origin_in_source()).norm() < 0.4 &&
         so3_log(pose.rotation * truth.rotation.transpose()).norm() < 0.3;
}

void record(const Result<Identification>& found, const Rigid3& truth, Campaign& campaign) {
  if (found->hypotheses.empty()) return;
  campaign.push_back({found->risk, verdict_is_near(found->hypotheses.front(), truth)});
  EXPECT_EQ(found.ok(), found->risk <= IdentifyOptions{}.max_risk);
}

IdentifyOptions calibrated() {
  IdentifyOptions options;
  options.model_sigma_px = 0.1;
  return options;
}

/// Four to eight lamps of a random map, up to three that are dark and up to six false lights.
Campaign random_maps(int count, std::uint64_t seed) {
  Random random(seed);
  Campaign campaign;
  for (int i = 0; i < count; ++i) {
    maps::Options options;
    options.lamps = i % 3 == 0 ? 20 : 10;
    options.visible = 4 + random.below(5);
    options.hidden = random.below(options.visible > 6 ? 1 : 4);
    options.false_lights = random.below(7);
    options.thickness_m = i % 2 ? 0.5 : 0;
    const View view = maps::random_view(random, options);
    IdentifyOptions by = calibrated();
    if (i % 4 < 2) by.prior = maps::gravity(view, 0.01, random);
    record(identify(view.blobs, view.scene, by), view.cam_from_world, campaign);
  }
  return campaign;
}

/// Lamps on a grid, almost at their places: one in five is dark, and there are false lights.
Campaign grids_with_dark_lamps(int count, std::uint64_t seed) {
  constexpr double dark = 0.2, sigma_px = 0.3;
  Random random(seed);
  Campaign campaign;
  for (int i = 0; i < count; ++i) {
    View view{maps::grid(4 + i % 2), {}, {}, {}};
    const double off_m = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 0.02 : 0.1;
    for (Lamp& lamp : view.scene.lamps)
      lamp.centre_m += off_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    maps::Options options;
    options.lamps = 4;
    options.max_tilt_rad = 0.3;
    view.cam_from_world = maps::random_pose(random, options);
    for (const Lamp& lamp : view.scene.lamps) {
      const auto px = view.scene.camera.project(view.cam_from_world * lamp.centre_m);
      if (!px || !view.scene.camera.contains(*px) || random.uniform() < dark) continue;
      const Eigen::Vector2d noise(random.normal(), random.normal());
      view.blobs.push_back(maps::spot(*px + sigma_px * noise, sigma_px));
    }
    for (int k = 0; k < i % 4; ++k)
      view.blobs.push_back(maps::spot({random.uniform(0, 479), random.uniform(0, 479)}, sigma_px));
    record(identify(view.blobs, view.scene, calibrated()), view.cam_from_world, campaign);
  }
  return campaign;
}

/// A gravity that is off by ten degrees, or the last pose of another place. One prior in twenty is
/// wrong, which is far more often than the evidence assumes.
Campaign wrong_priors(int count, std::uint64_t seed) {
  constexpr int one_of = 20;
  Random random(seed);
  Campaign campaign;
  for (int i = 0; i < count; ++i) {
    maps::Options options;
    options.lamps = 12;
    const View view = maps::random_view(random, options);
    IdentifyOptions by = calibrated();
    const bool wrong = random.below(one_of) == 0;
    if (i % 2) {
      by.prior = maps::gravity(view, 0.01, random);
      if (wrong) by.prior->gravity_in_cam = so3_exp({0.17, 0, 0}) * *by.prior->gravity_in_cam;
    } else {
      by.prior = Prior{};
      const Vector6 moved = Vector6::Constant(wrong ? 0.6 : 0.01);
      by.prior->last_pose =
          PriorPose{perturb(view.cam_from_world, moved), square(0.05) * Matrix6::Identity()};
    }
    record(identify(view.blobs, view.scene, by), view.cam_from_world, campaign);
  }
  return campaign;
}

/// Images that show no lamp: each stated pose is wrong.
Campaign false_lights_alone(int count, std::uint64_t seed) {
  Random random(seed);
  const Rigid3 nowhere{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Constant(1e6)};
  Campaign campaign;
  for (int i = 0; i < count; ++i) {
    maps::Options options;
    options.lamps = 5 + random.below(16);
    options.thickness_m = i % 2 ? 0.5 : 0;
    View view{maps::random_scene(random, options), maps::random_pose(random, options), {}, {}};
    const int lights = 4 + random.below(7);
    for (int k = 0; k < lights; ++k)
      view.blobs.push_back(maps::spot({random.uniform(0, 639), random.uniform(0, 479)},
                                      std::exp(random.uniform(-4, -0.5))));
    IdentifyOptions by;
    if (i % 3 == 0) by.prior = maps::gravity(view, 0.02, random);
    record(identify(view.blobs, view.scene, by), nowhere, campaign);
  }
  return campaign;
}

/// Three objects, of which the image shows the first, or a stranger, among false lights.
Campaign objects(int count, std::uint64_t seed) {
  Random random(seed);
  Campaign campaign;
  for (int i = 0; i < count; ++i) {
    std::vector<Object> known;
    for (int k = 0; k < 3; ++k) known.push_back(bodies::random_object(random, 12));
    const bool shown = i % 2 == 0;
    bodies::View view;
    bodies::add_object(view, shown ? 0 : -1, shown ? known[0] : bodies::random_object(random, 12),
                       bodies::random_pose(random, 2.4), random, 0.2);
    bodies::add_false_lights(view, 2, random, 0.2);
    bodies::shuffle(view, random);
    RecogniseOptions options;
    options.identify = calibrated();
    options.max_false_alarms = 1;
    const auto found = recognise(view.blobs, known, bodies::camera(), options);
    for (const RecognisedObject& o : found->found) {
      campaign.push_back({o.risk, shown && o.match.object == 0 &&
                                      bodies::is_right(o.match.poses.front(), view, 0)});
      EXPECT_EQ(o.status == Status::ok, o.risk <= options.identify.max_risk);
    }
  }
  return campaign;
}

/// Among the results with a stated risk of at most r, at most a share r is wrong, to within 2.6
/// standard deviations of a binomial number. No ok result is wrong.
void expect_calibrated(const Campaign& campaign, const char* name) {
  SCOPED_TRACE(name);
  for (const double r : {1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0}) {
    double stated = 0, wrong = 0;
    for (const Stated& result : campaign)
      if (result.risk <= r) ++stated, wrong += !result.right;
    ::testing::Test::RecordProperty(std::string(name) + "_" + std::to_string(r),
                                    std::to_string(static_cast<int>(wrong)) + " of " +
                                        std::to_string(static_cast<int>(stated)));
    if (r == 1e-4) {
      EXPECT_EQ(wrong, 0);
    }
    EXPECT_LE(wrong, r * stated + 2.6 * std::sqrt(r * stated)) << r << " of " << stated;
  }
}

int count_ok(const Campaign& campaign) {
  return static_cast<int>(std::count_if(campaign.begin(), campaign.end(), [](const Stated& s) {
    return s.risk <= IdentifyOptions{}.max_risk;
  }));
}

void verdicts_are_calibrated(int count, std::uint64_t seed) {
  const Campaign maps = random_maps(count, seed), grids = grids_with_dark_lamps(count, seed + 1),
                 priors = wrong_priors(count, seed + 2),
                 lights = false_lights_alone(count, seed + 3),
                 things = objects(count / 4, seed + 4);
  expect_calibrated(maps, "maps");
  expect_calibrated(grids, "grids");
  expect_calibrated(priors, "priors");
  // In images without lamps every pose is wrong, so they count among others.
  Campaign mixed = maps;
  mixed.insert(mixed.end(), lights.begin(), lights.end());
  expect_calibrated(mixed, "maps_and_false_lights");
  expect_calibrated(things, "objects");
  EXPECT_GE(count_ok(maps), 0.7 * count);
  EXPECT_GE(count_ok(priors), 0.9 * count);
  EXPECT_EQ(count_ok(lights), 0);
}

TEST(IdentifyVerdict, RiskIsTheShareOfWrongAnswers) { verdicts_are_calibrated(40, 1); }
TEST(SlowIdentifyVerdict, RiskIsTheShareOfWrongAnswers) { verdicts_are_calibrated(2000, 11); }

TEST(IdentifyVerdict, ProbabilitiesAddUpAndAreSorted) {
  Random random(21);
  const Scene grid = maps::grid(3);
  View view{grid, look_at({0.8, 0.8, 0.5}, {0.8, 0.8, 3}, {0, 1, 0}), {}, {}};
  for (const Lamp& lamp : grid.lamps)
    view.blobs.push_back(
        maps::spot(*grid.camera.project(view.cam_from_world * lamp.centre_m), 0.1));
  const Result<Identification> found = identify(view.blobs, grid);
  ASSERT_EQ(found.status, Status::ambiguous);
  ASSERT_EQ(found->hypotheses.size(), 4u);
  double sum = 0;
  for (const Hypothesis& h : found->hypotheses) {
    EXPECT_NEAR(h.probability, 0.25, 0.02);
    sum += h.probability;
  }
  EXPECT_LE(sum, 1 + 1e-12);
  EXPECT_NEAR(found->risk, 1 - found->hypotheses.front().probability, 1e-9);
  EXPECT_NE(found.message.find("4 poses match the image"), std::string::npos) << found.message;
  EXPECT_NE(found.message.find("a probability of 0.25"), std::string::npos) << found.message;
}

TEST(IdentifyVerdict, MaxRiskIsTheLimitOfOk) {
  Random random(22);
  maps::Options map;
  map.visible = 5;
  int limits = 0;
  for (int i = 0; i < 20; ++i) {
    const View view = maps::random_view(random, map);
    IdentifyOptions options;
    const double risk = identify(view.blobs, view.scene, options)->risk;
    if (!(risk > 1e-12 && risk < 0.5)) continue;
    ++limits;
    options.max_risk = 1.01 * risk;
    EXPECT_TRUE(identify(view.blobs, view.scene, options).ok());
    options.max_risk = 0.99 * risk;
    EXPECT_FALSE(identify(view.blobs, view.scene, options).ok());
  }
  EXPECT_GT(limits, 0);
  IdentifyOptions refused;
  refused.max_risk = 0;
  const View view = maps::random_view(random, map);
  EXPECT_NE(test::complaint([&] { identify(view.blobs, view.scene, refused); }).find("max_risk"),
            std::string::npos);
}

TEST(IdentifyVerdict, WhereFalseLightsAreMoreProbableThereIsNoPose) {
  Random random(23);
  int no_pose = 0;
  for (int i = 0; i < 10; ++i) {
    maps::Options options;
    options.lamps = 12;
    const Scene scene = maps::random_scene(random, options);
    std::vector<Blob> blobs;
    for (int k = 0; k < 8; ++k)
      blobs.push_back(maps::spot({random.uniform(0, 639), random.uniform(0, 479)}, 0.5));
    const Result<Identification> found = identify(blobs, scene);
    EXPECT_FALSE(found.ok());
    if (found.status != Status::no_pose || found->hypotheses.empty()) continue;
    ++no_pose;
    EXPECT_GT(found->risk, 0.5);
    EXPECT_NE(found.message.find("accidental"), std::string::npos) << found.message;
  }
  EXPECT_GT(no_pose, 0);
}

// The search for locate() leaves the verdict to refinement.
TEST(IdentifyVerdict, TheSearchAloneStatesNoRisk) {
  Random random(24);
  const View view = maps::random_view(random, {});
  const auto found = internal::identify::search_hypotheses(view.blobs, view.scene, {});
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->risk, 1);
  EXPECT_EQ(found->hypotheses.front().probability, 0);
}

// An object that is seen twice is no rival of itself.
TEST(RecogniseVerdict, TwoInstancesOfAnObjectAreBothOk) {
  Random random(4);
  const std::vector<Object> known{bodies::random_object(random, 16)};
  bodies::View view;
  for (int trials = 0; trials < 100; ++trials) {
    view = {};
    for (const double side : {-150.0, 150.0})
      bodies::add_object(view, side < 0 ? 0 : 1, known[0],
                         bodies::random_pose(random, 2.4, {side, 0}), random, 0.2);
    if (bodies::lights_of(view, 0) >= 7 && bodies::lights_of(view, 1) >= 7) break;
  }
  RecogniseOptions options;
  options.identify = calibrated();
  const auto found = recognise(view.blobs, known, bodies::camera(), options);
  ASSERT_EQ(found->found.size(), 2u);
  EXPECT_TRUE(found.ok()) << found.message;
  for (const RecognisedObject& o : found->found) EXPECT_LE(o.risk, 1e-4);
}

}  // namespace
}  // namespace occ
