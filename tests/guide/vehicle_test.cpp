// SPDX-License-Identifier: Apache-2.0
// Vehicles: exact arcs, reported limits, noise by distance, and odometry of the wheels.
#include "libocc/guide/vehicle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/support.hpp"

namespace {

using occ::test::complaint;

occ::Vehicle quick() {
  occ::Vehicle vehicle;
  vehicle.max_acceleration_m_s2 = vehicle.max_turn_acceleration_rad_s2 = 1e9;
  vehicle.max_steering_rate_rad_s = 1e9;
  return vehicle;
}

occ::DriveState driven(const occ::Vehicle& vehicle, const occ::DriveCommand& command, int steps,
                       double dt_s, std::uint64_t seed = 1, occ::DriveState state = {}) {
  occ::Random random(seed);
  for (int i = 0; i < steps; ++i) state = occ::drive(vehicle, state, command, dt_s, random).state;
  return state;
}

}  // namespace

TEST(Vehicle, DifferentialDriveGoesRoundACircle) {
  const occ::DriveState state = driven(quick(), {0.5, 1, 0}, 100, 0.02);
  EXPECT_NEAR(state.pose.x_m, 0.5 * std::sin(2.0), 1e-6);  // ramps last 1e-9 s
  EXPECT_NEAR(state.pose.y_m, 0.5 * (1 - std::cos(2.0)), 1e-6);
  EXPECT_NEAR(state.pose.heading_rad, 2, 1e-6);
  EXPECT_NEAR(state.time_s, 2, 1e-12);
}

TEST(Vehicle, AckermannGoesRoundTheCircleOfItsSteering) {
  occ::Vehicle vehicle = quick();
  vehicle.drive = occ::Drive::ackermann;
  const double radius = vehicle.wheelbase_m / std::tan(0.4);
  const occ::DriveState state = driven(vehicle, {0.5, 7, 0.4}, 100, 0.02);
  EXPECT_NEAR(state.pose.heading_rad, 1 / radius, 1e-6);
  EXPECT_NEAR((state.pose.position() - Eigen::Vector2d(0, radius)).norm(), radius, 1e-6);
  EXPECT_NEAR(vehicle.min_radius_m(), vehicle.wheelbase_m / std::tan(0.6), 1e-12);
  EXPECT_NEAR(state.turn_rate_rad_s, 0.5 / radius, 1e-12);
}

TEST(Vehicle, RampsDoNotDependOnTheStep) {
  occ::Vehicle vehicle;
  const occ::DriveCommand command{0.3, 0, 0};
  const occ::DriveState fine = driven(vehicle, command, 200, 0.005);
  const occ::DriveState coarse = driven(vehicle, command, 2, 0.5);
  EXPECT_NEAR(fine.pose.x_m, 0.3 - 0.5 * 0.3 * 0.6, 1e-12);  // 0.6 s to get to speed
  EXPECT_NEAR(coarse.pose.x_m, fine.pose.x_m, 1e-12);
}

TEST(Vehicle, ReportsActiveLimits) {
  occ::Vehicle vehicle;
  occ::Random random(1);
  const occ::DriveStep step = occ::drive(vehicle, {}, {9, -9, 0}, 0.1, random);
  EXPECT_TRUE(step.limited.speed && step.limited.turn && step.limited.acceleration &&
              step.limited.turn_change);
  EXPECT_NEAR(step.state.speed_m_s, 0.05, 1e-12);
  EXPECT_NEAR(step.state.turn_rate_rad_s, -0.5, 1e-12);
  const occ::DriveStep slow = occ::drive(vehicle, {}, {0.01, 0.01, 0}, 0.1, random);
  EXPECT_FALSE(slow.limited.any());
}

TEST(Vehicle, PerfectWheelsReportTheMotion) {
  occ::Vehicle vehicle;
  occ::Random random(3);
  const occ::DriveState begin{2, {1, 2, 0.5}, 0.4, 0.3, 0};
  const occ::DriveStep step = occ::drive(vehicle, begin, {0.5, 0.6, 0}, 0.2, random);
  EXPECT_NEAR(occ::difference(begin.pose * step.odometry.increment, step.state.pose).norm(), 0,
              1e-14);
  EXPECT_EQ(step.odometry.covariance, Eigen::Matrix3d(Eigen::Matrix3d::Zero()));
  EXPECT_EQ(step.odometry.from_s, 2);
  EXPECT_EQ(step.odometry.to_s, step.state.time_s);
}

TEST(Vehicle, AnAbsentEffectChangesNoBit) {
  occ::Vehicle noisy;
  noisy.noise.drive = noisy.noise.slip = 0.01;
  occ::Vehicle odometry_too = noisy;
  odometry_too.noise.odometry = 0.02;
  const occ::DriveState a = driven(noisy, {0.5, 0.3, 0}, 50, 0.02);
  const occ::DriveState b = driven(odometry_too, {0.5, 0.3, 0}, 50, 0.02);
  EXPECT_EQ(a.pose.x_m, b.pose.x_m);
  EXPECT_EQ(a.pose.heading_rad, b.pose.heading_rad);
  EXPECT_NE(a.pose.x_m, driven(noisy, {0.5, 0.3, 0}, 50, 0.02, 2).pose.x_m);
}

// The error of many short steps has the covariance reported by the odometry.
TEST(Vehicle, OdometryIsConsistent) {
  occ::Vehicle vehicle = quick();
  vehicle.noise.slip = 0.01;
  vehicle.noise.odometry = 0.02;
  vehicle.noise.sideways_slip = 0.01;
  double nees = 0;
  constexpr int runs = 2000;
  for (int run = 0; run < runs; ++run) {
    occ::Random random(static_cast<std::uint64_t>(run));
    const occ::DriveState begin{0, {}, 0.5, 1, 0};
    const occ::DriveStep step = occ::drive(vehicle, begin, {0.5, 1, 0}, 0.5, random);
    const Eigen::Vector3d error = occ::difference(step.odometry.increment, step.state.pose);
    nees += error.dot(step.odometry.covariance.inverse() * error);
  }
  const auto [low, high] = occ::test::chi2_interval(3 * runs);
  EXPECT_GT(nees, low);
  EXPECT_LT(nees, high);
}

TEST(Vehicle, NoiseGoesByLengthNotBySteps) {
  occ::Vehicle vehicle = quick();
  vehicle.noise.slip = 0.02;
  constexpr int runs = 400;
  double fine = 0, coarse = 0;
  for (int run = 0; run < runs; ++run) {
    const auto seed = static_cast<std::uint64_t>(run);
    fine += std::pow(driven(vehicle, {1, 0, 0}, 20, 0.05, seed).pose.heading_rad, 2);
    coarse += std::pow(driven(vehicle, {1, 0, 0}, 2, 0.5, seed + 1000).pose.heading_rad, 2);
  }
  const double expected = 2 * 0.02 * 0.02 / std::pow(vehicle.track_m, 2);  // 1 m
  EXPECT_NEAR(fine / runs, expected, 0.25 * expected);
  EXPECT_NEAR(coarse / runs, expected, 0.25 * expected);
}

TEST(Vehicle, SlipAndScaleSeparateTruthAndReport) {
  occ::Vehicle vehicle = quick();
  vehicle.noise.slip_share = 0.1;
  vehicle.noise.left_scale = vehicle.noise.right_scale = 1.05;
  occ::Random random(1);
  const occ::DriveState begin{0, {}, 1, 0, 0};
  const occ::DriveStep step = occ::drive(vehicle, begin, {1, 0, 0}, 1, random);
  EXPECT_NEAR(step.state.pose.x_m, 0.9, 1e-12);
  EXPECT_NEAR(step.odometry.increment.x_m, 1.05, 1e-12);
}

TEST(Vehicle, CurveCommandsKeepTheCurve) {
  occ::Vehicle vehicle;
  const occ::DriveCommand slower = occ::curve_command(vehicle, 1, -3);
  EXPECT_NEAR(slower.turn_rate_rad_s, -1.5, 1e-12);
  EXPECT_NEAR(slower.turn_rate_rad_s / slower.speed_m_s, -3, 1e-12);
  vehicle.drive = occ::Drive::ackermann;
  EXPECT_NEAR(occ::curve_command(vehicle, 1, -30).steering_rad, -0.6, 1e-12);
}

TEST(Vehicle, RejectsValuesThatAreNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  occ::Random random(1);
  occ::Vehicle vehicle;
  EXPECT_NE(complaint([&] {
              occ::drive(vehicle, {}, {nan, 0, 0}, 0.1, random);
            }).find("command.speed_m_s"),
            std::string::npos);
  EXPECT_NE(complaint([&] { occ::drive(vehicle, {}, {}, 0, random); }).find("dt_s"),
            std::string::npos);
  vehicle.noise.slip_share = 1;
  EXPECT_NE(complaint([&] { vehicle.validate(); }).find("slip_share"), std::string::npos);
  vehicle = {};
  vehicle.max_steering_rad = 2;
  EXPECT_THROW(vehicle.validate(), std::invalid_argument);
}
