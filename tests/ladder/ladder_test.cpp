// SPDX-License-Identifier: Apache-2.0
// The ladder on simulated frames: every step answers, errs as its bound says, and is timed.
#include "libocc/ladder/ladder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

struct Frame {
  Rendered rendered;
  LadderProblem problem;
};

Frame frame_of(const Scene& scene, const Rigid3& pose, std::uint32_t number) {
  SimulateOptions options;
  options.frame = number;
  Frame frame;
  frame.rendered = simulate(scene, pose, options);
  frame.problem = ladder_problem(frame.rendered.image.view(), scene, pose);
  return frame;
}

/// Returns false for a method that this build lacks (LIBOCC_OPENCV or LIBOCC_OPENGV is off).
bool in_build(const std::string& name) {
  return std::none_of(missing_ladder_steps().begin(), missing_ladder_steps().end(),
                      [&](const MissingMethod& missing) { return missing.name == name; });
}

Rigid3 view() { return look_at({2.1, 1.9, 0.5}, {2.3, 2.0, 3.0}, Eigen::Vector3d::UnitY()); }

TEST(Ladder, NamesBlobsByTheTruth) {
  const Scene scene = test::irregular_room();
  const Frame frame = frame_of(scene, view(), 0);
  const LadderProblem& p = frame.problem;
  ASSERT_EQ(p.matches.size(), 6u);
  EXPECT_GT(p.detect_s, 0);
  for (std::size_t i = 0; i < p.matches.size(); ++i) {
    const auto col = static_cast<Eigen::Index>(i);
    EXPECT_EQ(p.matches[i].lamp, static_cast<int>(i));
    EXPECT_EQ(p.points_in_world.col(col), scene.lamps[i].centre_m);
    EXPECT_LT((p.points_px.col(col) - frame.rendered.lamps[i].image_centre_px).norm(), 0.05);
  }
  EXPECT_GT(p.sigma_px, 0);
  EXPECT_LT(p.sigma_px, 0.5);
}

TEST(Ladder, RefinedStepsAttainTheirBoundAndClosedFormsDoNotBeatIt) {
  const Scene scene = test::irregular_room();
  std::map<std::string, double> squares, bounds;
  double least = 0;
  constexpr int frames = 30;
  for (std::uint32_t i = 0; i < frames; ++i) {
    const Frame frame = frame_of(scene, view(), i);
    least += std::pow(ladder_bound(frame.problem, Rung::direct).position_m, 2);
    for (const LadderStep& step : ladder_steps()) {
      if (!step.suits(frame.problem)) continue;
      const LadderOutcome outcome = run_step(frame.problem, step, 1e-9);
      if (!outcome.answered && std::string(step.name) == "dlt") continue;  // five are in a plane
      ASSERT_TRUE(outcome.answered) << step.name;
      EXPECT_GT(outcome.time_s, 0);
      squares[step.name] += std::pow(outcome.position_error_m, 2);
      bounds[step.name] += std::pow(outcome.bound.position_m, 2);
      EXPECT_GE(outcome.bound.position_expected_m, outcome.bound.position_m);
    }
  }
  const auto ratio = [&](const char* name) { return std::sqrt(squares[name] / bounds[name]); };
  for (const char* name : {"centres", "rims", "rims+flux", "direct"}) {
    EXPECT_GT(ratio(name), 0.7) << name;
    EXPECT_LT(ratio(name), 1.35) << name;
  }
  for (const char* name : {"p3p", "p3p_triples", "solve_pose", "points", "SQPNP", "AP3P"}) {
    if (!in_build(name)) continue;
    EXPECT_GT(ratio(name), 1.5) << name << " neglects the offset of the ellipse's centre";
    EXPECT_LT(std::sqrt(squares[name] / frames), 0.05) << name;
  }
  EXPECT_LT(std::sqrt(least), std::sqrt(bounds["rims"]));
  EXPECT_NEAR(std::sqrt(bounds["direct"] / least), 1, 1e-9);
}

TEST(Ladder, StepsSuitTheLayoutTheyAreFor) {
  const Frame deep = frame_of(test::irregular_room(), view(), 0);
  const Frame flat = frame_of(test::square_room(), view(), 0);
  const auto suits = [](const char* name, const Frame& frame) {
    return ladder_step_named(name).suits(frame.problem);
  };
  for (const char* name : {"IPPE", "homography", "posit_coplanar"}) {
    if (!in_build(name)) continue;
    EXPECT_TRUE(suits(name, flat)) << name;
    EXPECT_FALSE(suits(name, deep)) << name;
  }
  for (const char* name : {"dlt", "posit", "epnp"}) {
    if (!in_build(name)) continue;
    EXPECT_FALSE(suits(name, flat)) << name;
    EXPECT_TRUE(suits(name, deep)) << name;
  }
  for (const LadderStep& step : ladder_steps()) {
    if (!step.suits(flat.problem)) continue;
    EXPECT_TRUE(run_step(flat.problem, step, 1e-9).answered) << step.name;
  }
}

TEST(Ladder, TimesTheRefinementAlone) {
  const Frame frame = frame_of(test::irregular_room(), view(), 0);
  for (const Rung rung : {Rung::points, Rung::centres, Rung::rims, Rung::direct}) {
    const RefineTime time = time_refine(frame.problem, rung, 1e-9);
    EXPECT_EQ(time.work.lamps, 6);
    EXPECT_GT(time.work.rim_points, 100);
    EXPECT_GT(time.work.pixels, 1000);
    EXPECT_GT(time.time_s, 0);
  }
}

TEST(Ladder, RefusesWhatDoesNotFit) {
  const Scene scene = test::irregular_room();
  const Frame frame = frame_of(scene, view(), 0);
  EXPECT_NE(test::complaint([] { ladder_step_named("nosuch"); }).find("nosuch"), std::string::npos);
  EXPECT_NE(test::complaint([&] {
              run_step(frame.problem, ladder_step_named("p3p"), 0);
            }).find("min_time_s"),
            std::string::npos);
  EXPECT_NE(test::complaint([&] {
              run_step(frame.problem, ladder_step_named("homography"), 1);
            }).find("homography"),
            std::string::npos);
  for (const MissingMethod& missing : missing_ladder_steps()) {
    EXPECT_NE(test::complaint([&] { ladder_step_named(missing.name); }).find(missing.option),
              std::string::npos);
  }
  Scene other = scene;
  other.camera = Camera::pinhole(320, 240, 200, 200, 159.5, 119.5);
  EXPECT_NE(test::complaint([&] {
              ladder_problem(frame.rendered.image.view(), other, view());
            }).find("640"),
            std::string::npos);
}

}  // namespace
}  // namespace occ
