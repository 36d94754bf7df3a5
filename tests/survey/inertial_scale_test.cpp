// SPDX-License-Identifier: Apache-2.0
// Scale of a map by an inertial measurement unit whose axes, clock, place and errors are unknown.
#include "libocc/survey/internal/inertial_scale.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

using Eigen::Matrix3d;
using internal::survey::align_inertial;
using internal::survey::TimedPose;
using Motion = std::function<Rigid3(double)>;  // world from camera

/// Hand that carries a phone: slow steps with faster shaking.
Motion by_hand(std::uint64_t seed, double path_m = 1, double turn_rad = 0.25) {
  Random random(seed, 5);
  Vector3d phases, turn_phases, rates;
  for (int k = 0; k < 3; ++k) {
    phases[k] = random.uniform(0, 2 * pi);
    turn_phases[k] = random.uniform(0, 2 * pi);
    rates[k] = random.uniform(0.8, 1.2);
  }
  return [=](double t) {
    Vector3d at, turn;
    for (int k = 0; k < 3; ++k) {
      at[k] = path_m * (0.5 * std::sin(0.8 * rates[k] * t + phases[k]) +
                        0.05 * std::sin(5 * rates[k] * t + turn_phases[k]));
      turn[k] = turn_rad * (std::sin(1.1 * rates[k] * t + turn_phases[k]) +
                            0.2 * std::sin(4 * rates[k] * t + phases[k]));
    }
    return Rigid3{so3_exp({pi, 0, 0}) * so3_exp(turn), at};
  };
}

struct Unit {
  Matrix3d cam_from_imu = so3_exp({1.2, -0.5, 2});
  Vector3d place_in_cam_m = {0.03, -0.05, 0.01};
  double offset_s = 0, gain = 1, gravity_m_s2 = 9.81;
  Vector3d turn_bias_rad_s = {0.01, -0.02, 0.005}, bias_m_s2 = {0.1, -0.05, 0.08};
  double turn_noise_rad_sqrt_s = 1e-4, noise_m_s2_sqrt_hz = 2e-3, rate_hz = 200;
};

std::vector<ImuSample> samples_of(const Motion& motion, const Unit& unit, double from_s,
                                  double to_s, Random& random) {
  constexpr double h = 1e-3;
  const Rigid3 cam_from_imu{unit.cam_from_imu, unit.place_in_cam_m};
  const auto at = [&](double t) { return motion(t) * cam_from_imu; };
  std::vector<ImuSample> samples;
  const double root = std::sqrt(unit.rate_hz);
  for (double t = from_s; t < to_s; t += 1 / unit.rate_hz) {
    const Rigid3 before = at(t - h), now = at(t), after = at(t + h);
    const Vector3d acceleration =
        (after.translation - 2 * now.translation + before.translation) / (h * h) +
        Vector3d(0, 0, unit.gravity_m_s2);
    ImuSample sample;
    sample.time_s = t + unit.offset_s;
    sample.turn_rate_rad_s =
        so3_log(before.rotation.transpose() * after.rotation) / (2 * h) + unit.turn_bias_rad_s;
    sample.acceleration_m_s2 =
        unit.gain * (now.rotation.transpose() * acceleration) + unit.bias_m_s2;
    for (int k = 0; k < 3; ++k) {
      sample.turn_rate_rad_s[k] += unit.turn_noise_rad_sqrt_s * root * random.normal();
      sample.acceleration_m_s2[k] += unit.noise_m_s2_sqrt_hz * root * random.normal();
    }
    samples.push_back(sample);
  }
  return samples;
}

/// Poses in a map whose unit is `unit_m`, with errors of 0.3 mrad and 0.5 mm.
std::vector<TimedPose> poses_of(const Motion& motion, double unit_m, int count, double step_s,
                                Random& random) {
  const Rigid3 map_from_world{so3_exp({0.4, 0.2, -1}), {1, 2, 3}};
  Vector6 sigmas;
  sigmas << Vector3d::Constant(3e-4), Vector3d::Constant(5e-4 / unit_m);
  std::vector<TimedPose> poses;
  for (int i = 0; i < count; ++i) {
    const Rigid3 cam_from_map = (map_from_world * motion(step_s * i)).inverse();
    Vector6 error;
    for (int k = 0; k < 6; ++k) error[k] = sigmas[k] * random.normal();
    TimedPose pose;
    pose.time_s = step_s * i;
    pose.cam_from_map = {cam_from_map.rotation, cam_from_map.translation / unit_m};
    pose.cam_from_map = perturb(pose.cam_from_map, error);
    pose.covariance = sigmas.cwiseAbs2().asDiagonal();
    poses.push_back(pose);
  }
  return poses;
}

TEST(InertialScale, IsWithinItsSigma) {
  double squares = 0, sigmas = 0;
  constexpr int runs = 60;
  for (int seed = 1; seed <= runs; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 9);
    const Motion motion = by_hand(static_cast<std::uint64_t>(seed));
    Unit unit;
    unit.offset_s = 0.06 * random.normal();
    unit.gain = 1 + 0.01 * random.normal();
    unit.gravity_m_s2 = 9.807 + 0.03 * random.normal();
    const auto poses = poses_of(motion, 3.7, 50, 0.4, random);
    const auto imu = samples_of(motion, unit, -1, 21, random);
    const auto found = align_inertial(poses, imu);
    ASSERT_TRUE(found.ok()) << seed << ": " << found.message;
    squares += square((found->scale / 3.7 - 1) / found->scale_sigma) / runs;
    sigmas += found->scale_sigma / runs;
    EXPECT_LT(so3_log(found->cam_from_imu.transpose() * unit.cam_from_imu).norm(), 0.01) << seed;
    EXPECT_NEAR(found->time_offset_s, unit.offset_s, 2e-3) << seed;
    EXPECT_GT(found->down.dot(so3_exp({0.4, 0.2, -1}) * -Vector3d::UnitZ()), std::cos(0.01));
  }
  std::cout << "scale: sigma " << sigmas << ", squared errors over variances " << squares
            << std::endl;
  EXPECT_LT(sigmas, 0.01);
  EXPECT_GT(squares, 0.5);
  EXPECT_LT(squares, 1.6);
}

TEST(InertialScale, FindsAnotherClock) {
  Random random(1);
  const Motion motion = by_hand(3);
  Unit unit;
  unit.offset_s = 1.4e9;
  const auto found = align_inertial(poses_of(motion, 0.5, 40, 0.5, random),
                                    samples_of(motion, unit, -7, 25, random));
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_NEAR(found->time_offset_s, 1.4e9, 2e-3);
  EXPECT_NEAR(found->scale, 0.5, 3.5 * 0.5 * found->scale_sigma);
}

TEST(InertialScale, LeavesOutAGap) {
  Random random(1);
  const Motion motion = by_hand(4);
  auto imu = samples_of(motion, Unit(), -1, 25, random);
  imu.erase(imu.begin() + 1500, imu.begin() + 2100);
  const auto found = align_inertial(poses_of(motion, 2, 50, 0.4, random), imu);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_NEAR(found->scale, 2, 3.5 * 2 * found->scale_sigma);
}

TEST(InertialScale, LeavesOutWrongTimes) {
  Random random(1);
  const Motion motion = by_hand(4);
  auto poses = poses_of(motion, 2, 50, 0.4, random);
  poses[0].time_s += 0.1;
  poses[30].time_s += 0.1;
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].picture = static_cast<int>(i);
  const auto found = align_inertial(poses, samples_of(motion, Unit(), -1, 25, random));
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_NEAR(found->scale, 2, 3.5 * 2 * found->scale_sigma);
  EXPECT_LT(found->scale_sigma, 0.01);
  std::vector<int> left_out = found->contradictions;
  std::sort(left_out.begin(), left_out.end());
  EXPECT_EQ(left_out, (std::vector<int>{0, 29, 30}));
}

TEST(InertialScale, RefusesAnotherMotion) {
  Random random(1);
  const auto found = align_inertial(poses_of(by_hand(5), 2, 50, 0.4, random),
                                    samples_of(by_hand(6), Unit(), -5, 40, random));
  EXPECT_EQ(found.status, Status::no_pose) << found.message;
}

TEST(InertialScale, RefusesTurnsAboutOneAxis) {
  Random random(1);
  const Motion motion = [](double t) {
    return Rigid3{so3_exp({0, 0, 0.5 * std::sin(t)}), {std::sin(t), std::cos(2 * t), 0}};
  };
  const auto found = align_inertial(poses_of(motion, 2, 50, 0.4, random),
                                    samples_of(motion, Unit(), -1, 25, random));
  EXPECT_EQ(found.status, Status::degenerate) << found.message;
  EXPECT_NE(found.message.find("one axis"), std::string::npos) << found.message;
}

TEST(InertialScale, RefusesAMotionWithoutAcceleration) {
  Random random(1);
  const Motion turning = by_hand(8);
  const Motion motion = [&](double t) {
    return Rigid3{turning(t).rotation, {0.2 * t, 0.1 * t, 0}};
  };
  Unit unit;
  unit.place_in_cam_m.setZero();
  const auto found = align_inertial(poses_of(motion, 2, 50, 0.4, random),
                                    samples_of(motion, unit, -1, 25, random));
  EXPECT_EQ(found.status, Status::degenerate) << found->scale << ' ' << found->scale_sigma;
  EXPECT_NE(found.message.find("too evenly"), std::string::npos) << found.message;
}

TEST(InertialScale, RefusesTooFewPictures) {
  Random random(1);
  const Motion motion = by_hand(9);
  const auto few = align_inertial(poses_of(motion, 2, 9, 0.4, random),
                                  samples_of(motion, Unit(), -1, 25, random));
  EXPECT_EQ(few.status, Status::too_few_lamps);
  const auto outside = align_inertial(poses_of(motion, 2, 50, 0.4, random),
                                      samples_of(motion, Unit(), 15, 18, random));
  EXPECT_EQ(outside.status, Status::too_few_lamps);
  EXPECT_EQ(align_inertial({}, {}).status, Status::too_few_lamps);
}

}  // namespace
}  // namespace occ::test
