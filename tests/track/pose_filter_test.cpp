// SPDX-License-Identifier: Apache-2.0
// PoseFilter: consistency with each kind of motion sensor, order of arrival.
#include "libocc/track/pose_filter.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "libocc/geometry/motion.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

const Rigid3 cam_from_body = look_at({0.1, -0.05, 0.3}, {0.1, -0.05, 1}, {0, 1, 0});
constexpr double image_sigma = 3e-3;

Vector6 random6(Random& random) {
  Vector6 out;
  out << test::random_vector(random), test::random_vector(random);
  return out;
}

PoseObservation image_of(const Rigid3& body_from_world, double time_s, Random& random) {
  const Matrix6 covariance = image_sigma * image_sigma * Matrix6::Identity();
  const Rigid3 seen = perturb(cam_from_body * body_from_world, image_sigma * random6(random));
  return PoseObservation::of_pose(time_s, seen, covariance, cam_from_body);
}

double nees(const PosePrediction& estimate, const Rigid3& truth) {
  const Vector6 error = difference(truth, estimate.body_from_world);
  return test::nees(error, estimate.covariance);
}

const Matrix6 start_covariance = 1e-4 * Matrix6::Identity();

PoseFilter started(const Rigid3& truth, Random& random, const PoseFilterOptions& options = {}) {
  PoseFilter filter(options);
  filter.start(0, perturb(truth, 0.01 * random6(random)), start_covariance);
  return filter;
}

/// Expects the mean NEES of a pose over 300 runs within its 95 % interval.
void expect_consistent(double sum, int runs) {
  EXPECT_NEAR(sum / (6 * runs), 1, 1.96 * std::sqrt(2.0 / (6 * runs)));
}

TEST(PoseFilter, OdometrysErrorsAreAsLargeAsItSays) {
  double sum = 0;
  for (std::uint64_t run = 0; run < 300; ++run) {
    Random random(run);
    Rigid3 truth = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
    PoseFilter filter = started(truth, random);
    const double sigma = 2e-3;
    for (int i = 0; i < 40; ++i) {
      Vector6 motion;
      motion << 0.01, -0.02, 0.03, 0.02, -0.01, 0.05;
      const Rigid3 told = moved_pose({}, motion, 1);
      truth = perturb(told, sigma * random6(random)) * truth;
      filter.add(Odometry{0.1 * i, 0.1 * (i + 1), told, sigma * sigma * Matrix6::Identity()});
      if (i % 4 != 3) continue;
      EXPECT_TRUE(filter.add(image_of(truth, 0.1 * (i + 1), random)).accepted());
    }
    sum += nees(*filter.at(4), truth);
  }
  expect_consistent(sum, 300);
}

TEST(PoseFilter, WithoutSensorsTheMotionIsWhiteAcceleration) {
  double sum = 0;
  for (std::uint64_t run = 0; run < 300; ++run) {
    Random random(run);
    Rigid3 truth = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
    PoseFilterOptions options;
    Vector6 velocity = random6(random);
    PoseFilter filter = started(truth, random, options);
    constexpr double dt = 0.01;
    for (int i = 1; i <= 200; ++i) {
      truth = moved_pose(truth, velocity, dt);
      velocity.head<3>() +=
          options.turn_acceleration_noise * std::sqrt(dt) * test::random_vector(random);
      velocity.tail<3>() +=
          options.acceleration_noise * std::sqrt(dt) * test::random_vector(random);
      if (i % 5 == 0) filter.add(image_of(truth, dt * i, random));
    }
    const PoseEstimate estimate = *filter.at(2);
    sum += nees(estimate, truth);
    const Vector6 off = velocity - estimate.velocity;
    EXPECT_LT(test::nees(off, estimate.velocity_covariance), 40);
  }
  expect_consistent(sum, 300);
}

/// Body that swings and rotates, with the readings of its inertial sensors in closed form.
struct Swing {
  Eigen::Vector3d position(double t) const {
    return {std::sin(t), 0.5 * std::sin(2 * t), 0.2 * std::cos(t)};
  }
  Eigen::Vector3d acceleration(double t) const {
    return {-std::sin(t), -2 * std::sin(2 * t), -0.2 * std::cos(t)};
  }
  Eigen::Vector3d turn_rate{0.3, -0.2, 0.8};  // along the body's axes

  Eigen::Matrix3d world_from_body(double t) const { return so3_exp(turn_rate * t); }
  Rigid3 body_from_world(double t) const {
    return Rigid3{world_from_body(t), position(t)}.inverse();
  }
};

TEST(PoseFilter, InertialSensorsErrorsAreAsLargeAsItSays) {
  const Swing swing;
  const PoseFilterOptions options;
  constexpr double dt = 0.005;
  double sum = 0;
  for (std::uint64_t run = 0; run < 300; ++run) {
    Random random(run);
    PoseFilter filter = started(swing.body_from_world(0), random, options);
    const Eigen::Vector3d gyro_bias = options.gyro_bias_sigma * test::random_vector(random);
    const Eigen::Vector3d bias = options.accelerometer_bias_sigma * test::random_vector(random);
    for (int i = 0; i < 400; ++i) {
      const double middle = (i + 0.5) * dt;
      ImuSample sample;
      sample.time_s = i * dt;
      sample.turn_rate_rad_s = swing.turn_rate + gyro_bias +
                               options.gyro_noise / std::sqrt(dt) * test::random_vector(random);
      sample.acceleration_m_s2 =
          swing.world_from_body(middle).transpose() *
              (swing.acceleration(middle) - options.gravity_m_s2) +
          bias + options.accelerometer_noise / std::sqrt(dt) * test::random_vector(random);
      filter.add(sample);
      if (i % 20 == 19)
        filter.add(image_of(swing.body_from_world((i + 1) * dt), (i + 1) * dt, random));
    }
    sum += nees(*filter.at(2), swing.body_from_world(2));
    EXPECT_LT((filter.at(2)->gyro_bias_rad_s - gyro_bias).norm(), 0.02);
  }
  expect_consistent(sum, 300);
}

TEST(PoseFilter, OdometryOutweighsTheAccelerometer) {
  const Rigid3 start = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
  Vector6 motion;
  motion << 0, 0, 0, 0.02, -0.01, 0.05;
  const Rigid3 told = moved_pose({}, motion, 1);
  PoseFilter without, with;
  for (PoseFilter* filter : {&without, &with}) filter->start(0, start, start_covariance);
  ImuSample sample;
  sample.acceleration_m_s2 = {20, -30, 40};
  with.add(sample);
  for (PoseFilter* filter : {&without, &with})
    filter->add(Odometry{0, 0.1, told, 1e-6 * Matrix6::Identity()});
  const Rigid3 expected = without.at(0.1)->body_from_world;
  EXPECT_LT(difference(with.at(0.1)->body_from_world, expected).norm(), 1e-9);
  EXPECT_LT(difference(expected, told * start).norm(), 1e-9);
}

TEST(PoseFilter, GravityAndBiasesHoldABodyThatStands) {
  PoseFilter filter;
  const Rigid3 pose = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
  filter.start(0, pose, 1e-8 * Matrix6::Identity());
  for (int i = 0; i < 100; ++i) {
    ImuSample sample;
    sample.time_s = 0.01 * i;
    sample.acceleration_m_s2 = pose.rotation * Eigen::Vector3d(0, 0, 9.80665);
    filter.add(sample);
  }
  EXPECT_LT(difference(filter.at(1)->body_from_world, pose).norm(), 1e-12);
}

TEST(PoseFilter, WhatArrivesLateCountsAsIfItHadNot) {
  Random random(3);
  const Swing swing;
  std::vector<PoseObservation> images;
  std::vector<ImuSample> samples;
  for (int i = 0; i < 30; ++i) {
    images.push_back(image_of(swing.body_from_world(0.05 * (i + 1)), 0.05 * (i + 1), random));
    ImuSample sample;
    sample.time_s = 0.05 * i;
    sample.turn_rate_rad_s = swing.turn_rate;
    samples.push_back(sample);
  }
  PoseFilterOptions options;
  options.use_accelerometer = false;
  options.gate_sigma = std::numeric_limits<double>::infinity();
  PoseFilter ordered(options), mixed(options);
  for (PoseFilter* filter : {&ordered, &mixed})
    filter->start(0, swing.body_from_world(0), start_covariance);
  for (std::size_t i = 0; i < 30; ++i) {
    ordered.add(samples[i]);
    ordered.add(images[i]);
  }
  for (std::size_t i = 0; i < 30; i += 2) {
    mixed.add(images[i + 1]);
    mixed.add(samples[i + 1]);
    mixed.add(images[i]);
    mixed.add(samples[i]);
  }
  const PoseEstimate p = *ordered.at(1.5), q = *mixed.at(1.5);
  EXPECT_LT(difference(p.body_from_world, q.body_from_world).norm(), 1e-11);
  EXPECT_LT((p.covariance - q.covariance).norm(), 1e-11 * p.covariance.norm());
}

TEST(PoseFilter, APoseIsWeighedByItsCovariance) {
  PoseFilter filter;
  Random random(4);
  const Rigid3 truth = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
  filter.start(0, truth, start_covariance);
  Vector6 off;
  off << 0, 0, 0, 0.01, -0.02, 0.005;
  filter.add(PoseObservation::of_pose(0, perturb(truth, off), start_covariance));
  const Vector6 half = difference(filter.at(0)->body_from_world, truth);
  EXPECT_LT((half - off / 2).norm(), 1e-12);
  // The perturbations of one pose at two times differ by the motion in between.
  EXPECT_LT((filter.at(0)->covariance - start_covariance / 2).norm(), 0.02 * 1e-4);
}

TEST(PoseFilter, ThrowsForWhatIsNotNumbers) {
  PoseFilter filter;
  EXPECT_EQ(filter.add(ImuSample{}).outcome, FilterOutcome::not_started);
  EXPECT_THROW(filter.start(0, {}, Matrix6::Zero()), std::invalid_argument);
  filter.start(0, {}, start_covariance);
  ImuSample sample;
  sample.acceleration_m_s2.x() = std::nan("");
  EXPECT_THROW(filter.add(sample), std::invalid_argument);
  EXPECT_THROW(filter.add(Odometry{1, 0, {}, {}}), std::invalid_argument);
  EXPECT_THROW(filter.at(std::nan("")), std::invalid_argument);
  PoseFilterOptions wrong;
  wrong.history_s = 0;
  EXPECT_THROW(PoseFilter{wrong}, std::invalid_argument);
}

}  // namespace
}  // namespace occ
