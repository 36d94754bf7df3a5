// SPDX-License-Identifier: Apache-2.0
// Closed-loop runs: a vehicle follows its route by rendered images and docks, with each of the
// faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/guide/plan_pan_tilt.hpp"
#include "libocc/guide/plan_route.hpp"
#include "tests/guide/guide_loop_support.hpp"
#include "tests/support/support.hpp"

namespace {

using occ::pi;
using occ::test::complaint;
using occ::test::four_lamp_room;
using occ::test::four_lamp_route;
using occ::test::narrow_room;
using occ::test::real_options;

constexpr double docked_rad = 0.1 * pi / 180;

occ::LoopResult lap(const occ::LoopOptions& options) {
  return occ::closed_loop(four_lamp_room(), four_lamp_route(1), options);
}

void expect_arrival(const occ::LoopResult& result, double cross_track_m = 5e-3) {
  EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived) << result.message;
  EXPECT_LT(result.metrics.cross_track_rmse_m, cross_track_m);
  EXPECT_LT(result.metrics.final_position_error_m, 2e-3);
  EXPECT_LT(result.metrics.final_heading_error_rad, docked_rad);
}

/// Six lamps without rotational symmetry, so that a lost vehicle can relocalise.
occ::Scene telling_room() {
  occ::Scene scene = four_lamp_room();
  for (int i = 0; i < 2; ++i) {
    occ::Lamp lamp = scene.lamps[0];
    lamp.id = 4 + i;
    lamp.centre_m = i == 0 ? Eigen::Vector3d(1.7, 1.3, 3) : Eigen::Vector3d(2.2, 2.5, 3);
    scene.lamps.push_back(lamp);
  }
  return scene;
}

}  // namespace

TEST(ClosedLoop, DrivesALapAndDocks) {
  const occ::LoopResult result = lap(real_options());
  expect_arrival(result, 2e-3);
  const occ::LoopMetrics& metrics = result.metrics;
  EXPECT_EQ(metrics.availability, 1);
  EXPECT_EQ(metrics.lost_s, 0);
  EXPECT_LT(metrics.position_rmse_m, 1e-3);
  EXPECT_GT(metrics.nees, 1.5);  // means over one run with correlated errors
  EXPECT_LT(metrics.nees, 4.5);
  EXPECT_GT(metrics.nis_per_dof, 0.5);
  EXPECT_LT(metrics.nis_per_dof, 1.3);
  EXPECT_NEAR(metrics.driven_m, four_lamp_route(1).length_m() + 0.8, 0.02);
}

TEST(ClosedLoop, IsDeterminedByItsSeed) {
  occ::LoopOptions options = real_options(7);
  options.max_s = 4;
  const occ::LoopResult a = lap(options), b = lap(options);
  ASSERT_EQ(a.records.size(), b.records.size());
  for (std::size_t i = 0; i < a.records.size(); ++i) {
    EXPECT_EQ(a.records[i].truth.x_m, b.records[i].truth.x_m);
    EXPECT_EQ(a.records[i].estimate.pose.heading_rad, b.records[i].estimate.pose.heading_rad);
  }
  options.seed = 8;
  EXPECT_NE(lap(options).records.back().truth.x_m, a.records.back().truth.x_m);
}

TEST(ClosedLoop, APerfectWorldNeedsNoNoise) {
  occ::LoopOptions options;
  options.image_noise = false;
  expect_arrival(lap(options), 2e-3);
}

TEST(ClosedLoop, BothVehiclesAndControllersWork) {
  occ::LoopOptions options = real_options();
  options.follower = occ::Follower::stanley;
  expect_arrival(lap(options), 2e-3);
  options = real_options();
  options.vehicle.drive = occ::Drive::ackermann;
  options.vehicle.wheelbase_m = 0.2;
  options.vehicle.max_steering_rad = 0.8;
  const occ::LoopResult car = lap(options);
  EXPECT_EQ(car.outcome, occ::LoopOutcome::arrived);
  EXPECT_LT(car.metrics.cross_track_rmse_m, 5e-3);
  EXPECT_LT(car.metrics.final_position_error_m, 2e-3);
}

TEST(ClosedLoop, LocateAloneDrives) {
  occ::LoopOptions options = real_options();
  options.estimation = occ::LoopEstimation::locate;
  expect_arrival(lap(options));
}

TEST(ClosedLoop, ImagesMayBeLateLostOrRepeated) {
  occ::LoopOptions options = real_options();
  options.faults.latency_s = 0.08;
  expect_arrival(lap(options));
  options = real_options();
  options.faults.frame_loss = 0.5;
  options.faults.frame_repeat = 0.3;
  const occ::LoopResult lossy = lap(options);
  expect_arrival(lossy);
  EXPECT_NEAR(lossy.metrics.availability, 0.5, 0.08);
  EXPECT_GT(lossy.metrics.longest_outage_s, 0.05);
}

TEST(ClosedLoop, LampsMayFail) {
  for (int lamp = 0; lamp < 4; ++lamp) {
    occ::LoopOptions options = real_options();
    options.faults.lamp_failures = {{lamp, 4}};
    const occ::LoopResult result = lap(options);
    expect_arrival(result);
    EXPECT_EQ(result.metrics.lost_s, 0);
  }
}

TEST(ClosedLoop, CoastsThroughTheDark) {
  occ::LoopOptions options = real_options();
  for (int lamp = 0; lamp < 4; ++lamp) options.faults.lamp_failures.push_back({lamp, 5, 5.5});
  const occ::LoopResult result = lap(options);
  expect_arrival(result);
  EXPECT_NEAR(result.metrics.longest_outage_s, 0.5, 0.04);
  const auto coasting = [](const occ::LoopRecord& record) {
    return record.estimate.state == occ::TrackerState::coasting && !record.estimate.reason.empty();
  };
  EXPECT_TRUE(std::any_of(result.records.begin(), result.records.end(), coasting));
}

TEST(ClosedLoop, StandsStillWhenLost) {
  occ::LoopOptions options = real_options();
  for (int lamp = 0; lamp < 4; ++lamp) options.faults.lamp_failures.push_back({lamp, 5});
  options.max_lost_s = 3;
  const occ::LoopResult result = lap(options);
  EXPECT_EQ(result.outcome, occ::LoopOutcome::lost);
  EXPECT_NE(result.message.find("no pose for"), std::string::npos) << result.message;
  EXPECT_NEAR(result.metrics.lost_s, 3, 0.02);
  EXPECT_EQ(result.records.back().command.speed_m_s, 0);
  const Eigen::Vector2d stood = result.records[result.records.size() - 100].truth.position();
  EXPECT_EQ((result.records.back().truth.position() - stood).norm(), 0);
}

TEST(ClosedLoop, OdometryMayHaveGrossErrors) {
  occ::LoopOptions options = real_options();
  options.faults.odometry_faults = {{5, 8, 1.2, 0.1}};
  expect_arrival(lap(options), 10e-3);
}

TEST(ClosedLoop, AClockMayJump) {
  for (const double jump_s : {-0.5, 0.7, 1e4}) {
    occ::LoopOptions options = real_options();
    options.faults.clock_jumps = {{5, jump_s}};
    const occ::LoopResult result = lap(options);
    expect_arrival(result);
    EXPECT_EQ(result.metrics.clock_jumps, 1);
    EXPECT_EQ(result.metrics.relocations, 0);
  }
}

TEST(ClosedLoop, AKidnappedVehicleIsRelocalisedAndReportsIt) {
  occ::LoopOptions options = real_options();
  options.faults.kidnappings = {{5, {2.5, 1.4, 1.2}}};
  const occ::LoopResult result = occ::closed_loop(telling_room(), four_lamp_route(1), options);
  EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived) << result.message;
  EXPECT_GE(result.metrics.relocations, 1);
  EXPECT_LT(result.metrics.final_position_error_m, 2e-3);
}

TEST(ClosedLoop, ACollisionEndsTheRun) {
  occ::LoopOptions options = real_options();
  options.vehicle.radius_m = 0.3;
  options.faults.kidnappings = {{2, {0.2, 2, pi}}};
  const occ::LoopResult inside = lap(options);
  EXPECT_EQ(inside.outcome, occ::LoopOutcome::collision);
  EXPECT_NE(inside.message.find("a wall"), std::string::npos) << inside.message;
}

TEST(ClosedLoop, ReportsCommandsBeyondTheLimits) {
  occ::LoopOptions options = real_options();
  options.vehicle.max_speed_m_s = 0.3;  // the route requires 0.5
  options.max_s = 3;
  const occ::LoopResult result = lap(options);
  EXPECT_GT(result.metrics.limited_steps, 200);
  EXPECT_LE(result.records.back().command.speed_m_s, 0.3);
}

TEST(ClosedLoop, RejectsImpossibleRuns) {
  occ::LoopOptions options;
  options.vehicle.radius_m = 1.3;
  EXPECT_NE(complaint([&] { lap(options); }).find("a wall"), std::string::npos);
  options = {};
  options.faults.lamp_failures = {{9, 1}};
  EXPECT_NE(complaint([&] { lap(options); }).find("lamp_failures[0]"), std::string::npos);
  options = {};
  options.faults.frame_loss = 1.5;
  EXPECT_NE(complaint([&] { lap(options); }).find("frame_loss"), std::string::npos);
  options = {};
  options.start = occ::PlanarPose{0.1, 0.1, 0};
  EXPECT_NE(complaint([&] { lap(options); }).find("start"), std::string::npos);
  options = {};
  options.tracker.floor.reset();
  EXPECT_NE(complaint([&] { lap(options); }).find("floor"), std::string::npos);
}

// With a 3 mm lens no lamp is visible from the middle of the room.
TEST(ClosedLoop, ALongLensNeedsPanAndTilt) {
  const occ::Scene scene = narrow_room();
  occ::LoopOptions options = real_options();
  const occ::LoopResult fixed = occ::closed_loop(scene, four_lamp_route(1), options);
  EXPECT_LT(fixed.metrics.availability, 0.9);
  EXPECT_GT(fixed.metrics.longest_outage_s, 1);
  const occ::PanTiltResult plan = occ::plan_pan_tilt(scene, four_lamp_route(1));
  ASSERT_EQ(plan.status, occ::PlanStatus::ok);
  options.pan_tilt = plan.plan;
  const occ::LoopResult tilted = occ::closed_loop(scene, four_lamp_route(1), options);
  EXPECT_EQ(tilted.outcome, occ::LoopOutcome::arrived) << tilted.message;
  EXPECT_GE(tilted.metrics.availability, 0.99);
}

TEST(ClosedLoop, ALongLensWorksWithAPlannedRoute) {
  const occ::Scene scene = narrow_room();
  occ::RoutePlanOptions planning;
  planning.corner_radius_m = 0.4;
  const occ::RoutePlan plan =
      occ::plan_route(scene, {1.6, 1.2, 0}, {{{2.8, 1.6}, {}}, {{1.2, 2.6}, {}}}, planning);
  ASSERT_EQ(plan.status, occ::PlanStatus::ok) << plan.message;
  const occ::LoopResult result = occ::closed_loop(scene, *plan.route, real_options());
  EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived) << result.message;
  EXPECT_GE(result.metrics.availability, 0.99);
}

// Performance target of the project: 20 m at 0.5 m/s, thirty times.
TEST(SlowClosedLoop, ThirtyRunsOfTwentyMetres) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    for (const bool fails : {false, true}) {
      occ::LoopOptions options = real_options(seed);
      if (fails) options.faults.lamp_failures = {{static_cast<int>(seed % 4), 20}};
      const occ::LoopResult result = occ::closed_loop(four_lamp_room(), four_lamp_route(), options);
      expect_arrival(result, fails ? 10e-3 : 5e-3);
      EXPECT_GT(result.metrics.driven_m, 20);
      EXPECT_EQ(result.metrics.lost_s, 0);
    }
  }
}
