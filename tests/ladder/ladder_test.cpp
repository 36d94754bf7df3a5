// SPDX-License-Identifier: Apache-2.0
// The ladder on simulated frames: every step answers, errs as its bound says, and is timed.
#include "libocc/ladder/ladder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
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

// Panels and tubes: the rungs attain the bounds of their observations as for discs.
TEST(Ladder, RefinedStepsAttainTheirBoundForRectangles) {
  struct Kind {
    Eigen::Vector2d size_m;
    double distance_m;
  };
  for (const Kind& kind : {Kind{{0.5, 0.5}, 2.4}, Kind{{1.2, 0.06}, 2.4}, Kind{{1.2, 0.06}, 3.8}}) {
    SCOPED_TRACE(kind.size_m.transpose());
    Scene scene = test::irregular_room();
    scene.camera = Camera::pinhole(640, 480, 330, 330, 319.5, 239.5);
    scene.lamps.resize(5);
    for (Lamp& lamp : scene.lamps) {
      lamp.shape = LampShape::rectangle;
      lamp.size_m = kind.size_m;
      lamp.x_axis = Eigen::Vector3d::UnitX();
      lamp.power_w = 50 * kind.size_m.prod();
    }
    scene.validate();
    std::map<std::string, double> squares;
    Random random(3);
    int frames = 0;
    while (frames < 40) {
      const double turn = random.uniform(0, 2 * pi);
      const Rigid3 pose =
          look_at({random.uniform(1.7, 2.3), random.uniform(1.7, 2.3), 3 - kind.distance_m},
                  {2.0, 2.0, 3.0}, {std::cos(turn), std::sin(turn), 0});
      const Frame frame = frame_of(scene, pose, static_cast<std::uint32_t>(frames));
      if (frame.problem.matches.size() < 5) continue;
      ++frames;
      for (const char* name : {"centres", "rims", "direct"}) {
        const LadderOutcome outcome = run_step(frame.problem, ladder_step_named(name), 1e-9);
        ASSERT_TRUE(outcome.answered) << name;
        squares[name] += std::pow(outcome.position_error_m / outcome.bound.position_m, 2) / 40;
      }
    }
    for (const auto& [name, square] : squares) {
      EXPECT_GT(std::sqrt(square), 0.65) << name;
      EXPECT_LT(std::sqrt(square), 1.2) << name;
    }
  }
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
