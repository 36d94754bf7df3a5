// SPDX-License-Identifier: Apache-2.0
// Covariances that PoseFilter and PlanarFilter predict: against numerical derivatives of their own
// prediction, and against the closed form of white noise that is integrated once or twice.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/geometry/motion.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Vector18 = Eigen::Matrix<double, 18, 1>;
using Vector12 = Eigen::Matrix<double, 12, 1>;

/// Sample of an inertial sensor that reads zero.
ImuSample still_sample(double time_s) {
  ImuSample sample;
  sample.time_s = time_s;
  return sample;
}

enum Sensors { no_sensors, gyroscope, inertial, odometry, odometry_and_gyroscope };

constexpr double propagation_s = 0.3, imu_step_s = 0.0025;

PoseFilterOptions noiseless_space() {
  PoseFilterOptions o;
  o.acceleration_noise = o.turn_acceleration_noise = 0;
  o.gyro_noise = o.gyro_bias_walk = o.accelerometer_noise = o.accelerometer_bias_walk = 0;
  o.gyro_bias_sigma = o.accelerometer_bias_sigma = 1e-9;
  return o;
}

/// Filter of a body that moves fast at time 0. `off`: changes of the pose, the velocity and the
/// biases at time 0. The velocity at time 0 is that of a step of odometry before.
PoseFilter moving_body(const PoseFilterOptions& options, Sensors sensors, const Vector18& off,
                       const Matrix6& start, const Matrix6& step) {
  Vector6 velocity;
  velocity << 0.9, -1.2, 0.7, 1.5, -0.8, 1.1;
  velocity += off.segment<6>(6);
  const Rigid3 increment = moved_pose({}, velocity, 0.1);
  const Rigid3 at_zero = perturb(look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1}), off.head<6>());
  PoseFilterOptions used = options;
  used.use_accelerometer = sensors == inertial;
  PoseFilter filter(used);
  filter.start(-0.1, increment.inverse() * at_zero, start);
  filter.add(Odometry{-0.1, 0, increment, step});
  Vector6 later;
  later << -0.3, 0.2, 0.25, 0.4, 0.5, -0.3;
  if (sensors == odometry || sensors == odometry_and_gyroscope)
    filter.add(Odometry{0, propagation_s, moved_pose({}, later, 1), 1e-24 * Matrix6::Identity()});
  if (sensors == no_sensors || sensors == odometry) return filter;
  for (int i = 0; i * imu_step_s < propagation_s; ++i) {
    const double t = i * imu_step_s;
    ImuSample sample;
    sample.time_s = t;
    sample.turn_rate_rad_s = Eigen::Vector3d(-0.9 + t, 1.2, -0.7) - off.segment<3>(12);
    sample.acceleration_m_s2 = Eigen::Vector3d(2, 5 - 3 * t, -4) - off.tail<3>();
    filter.add(sample);
  }
  return filter;
}

/// Pose and velocity at the end, as changes from those without `off`.
Vector12 moved_body(Sensors sensors, const Vector18& off) {
  const Matrix6 tiny = 1e-20 * Matrix6::Identity();
  const PoseFilter from = moving_body(noiseless_space(), sensors, Vector18::Zero(), tiny, tiny);
  const PoseFilter to = moving_body(noiseless_space(), sensors, off, tiny, tiny);
  const PoseEstimate a = *from.at(propagation_s), b = *to.at(propagation_s);
  Vector12 out;
  out << difference(b.body_from_world, a.body_from_world), b.velocity - a.velocity;
  return out;
}

/// Random positive definite matrix with standard deviations of about `sigma`.
Matrix6 spread_covariance(Random& random, double sigma) {
  Matrix6 root = sigma * Matrix6::Identity();
  for (double& value : root.reshaped()) value += 0.3 * sigma * random.normal();
  return root * root.transpose();
}

class FilterPropagation : public ::testing::TestWithParam<Sensors> {};

// One source of uncertainty at a time, so that none hides the others.
TEST_P(FilterPropagation, InSpaceFollowsTheDerivativesOfThePrediction) {
  const Sensors sensors = GetParam();
  const Eigen::MatrixXd jacobian = test::numerical_jacobian(
      [&](const Eigen::VectorXd& off) { return Eigen::VectorXd(moved_body(sensors, off)); },
      Eigen::VectorXd::Zero(18), 1e-5);
  Random random(3);
  for (int source = 0; source < 4; ++source) {
    PoseFilterOptions options = noiseless_space();
    const Matrix6 tiny = 1e-20 * Matrix6::Identity();
    // The error of the step also moves the pose at time 0.
    const Matrix6 start = source == 0 ? spread_covariance(random, 1e-2) : tiny;
    const Matrix6 step = source == 1 ? spread_covariance(random, 1e-3) : tiny;
    if (source == 2) options.gyro_bias_sigma = 0.1;
    if (source == 3) options.accelerometer_bias_sigma = 0.1;
    const PoseFilter filter = moving_body(options, sensors, Vector18::Zero(), start, step);
    const PoseEstimate at_zero = *filter.at(0), end = *filter.at(propagation_s);
    Eigen::MatrixXd before = Eigen::MatrixXd::Zero(18, 18);
    before.topLeftCorner<6, 6>() = at_zero.covariance;
    before.block<6, 6>(6, 6) = step / (0.1 * 0.1);
    before.diagonal().segment<3>(12).setConstant(std::pow(options.gyro_bias_sigma, 2));
    before.diagonal().tail<3>().setConstant(std::pow(options.accelerometer_bias_sigma, 2));
    const Eigen::MatrixXd after = jacobian * before * jacobian.transpose();
    const Matrix6 pose = after.topLeftCorner<6, 6>(), velocity = after.bottomRightCorner<6, 6>();
    // The filter takes the velocity's effect at the middle of each stretch.
    const double floor = 1e-12;
    EXPECT_LT((end.covariance - pose).norm(), 0.03 * pose.norm() + floor) << "source " << source;
    EXPECT_LT((end.velocity_covariance - velocity).norm(), 0.03 * velocity.norm() + floor)
        << "source " << source;
  }
}

INSTANTIATE_TEST_SUITE_P(Sensors, FilterPropagation,
                         ::testing::Values(no_sensors, gyroscope, inertial, odometry,
                                           odometry_and_gyroscope));

/// Filter of a body at rest in the world's frame, whose inertial samples read gravity only.
PoseFilter resting_body(const PoseFilterOptions& options, bool samples, double end_s) {
  PoseFilter filter(options);
  filter.start(0, Rigid3{}, 1e-16 * Matrix6::Identity());
  filter.add(Odometry{-1, 0, {}, Matrix6::Zero()});
  for (double t = 0; samples && t < end_s; t += imu_step_s) {
    ImuSample sample;
    sample.time_s = t;
    sample.acceleration_m_s2 = -options.gravity_m_s2;
    filter.add(sample);
  }
  return filter;
}

/// Filter whose velocity at time 0 is exactly zero.
PoseFilter stopped_body(const PoseFilterOptions& options, bool samples, double end_s) {
  PoseFilterOptions used = options;
  used.start_speed_sigma_m_s = used.start_turn_sigma_rad_s = 1e-9;
  return resting_body(used, samples, end_s);
}

TEST(FilterNoise, WhiteAccelerationInSpaceIsIntegratedTwice) {
  PoseFilterOptions options = noiseless_space();
  options.acceleration_noise = 0.4;
  options.turn_acceleration_noise = 0.7;
  const double t = 1.5;
  const PoseEstimate end = *stopped_body(options, false, t).at(t);
  for (int i = 0; i < 6; ++i) {
    const double q = i < 3 ? 0.7 * 0.7 : 0.4 * 0.4;
    EXPECT_NEAR(end.velocity_covariance(i, i), q * t, 1e-3 * q * t) << i;
    EXPECT_NEAR(end.covariance(i, i), q * t * t * t / 3, 1e-3 * q * t * t * t) << i;
  }
}

TEST(FilterNoise, OfInertialSensorsIsIntegrated) {
  const double t = 2;
  PoseFilterOptions options = noiseless_space();
  options.gyro_noise = 0.01;
  options.gravity_m_s2.setZero();  // else a wrong tilt also accelerates
  EXPECT_NEAR(stopped_body(options, true, t).at(t)->covariance(0, 0), 1e-4 * t, 1e-3 * 1e-4 * t);
  options = noiseless_space();
  options.gravity_m_s2.setZero();
  options.gyro_bias_walk = 0.01;
  EXPECT_NEAR(stopped_body(options, true, t).at(t)->covariance(1, 1), 1e-4 * t * t * t / 3,
              0.02 * 1e-4 * t * t * t / 3);
  options.gyro_bias_walk = 0;
  options.accelerometer_noise = 0.05;
  PoseEstimate end = *stopped_body(options, true, t).at(t);
  EXPECT_NEAR(end.velocity_covariance(4, 4), 0.0025 * t, 0.01 * 0.0025 * t);
  EXPECT_NEAR(end.covariance(4, 4), 0.0025 * t * t * t / 3, 0.02 * 0.0025 * t * t * t / 3);
  EXPECT_LT(end.covariance(0, 0), 1e-9);
  options.accelerometer_noise = 0;
  options.accelerometer_bias_walk = 0.05;
  end = *stopped_body(options, true, t).at(t);
  EXPECT_NEAR(end.velocity_covariance(5, 5), 0.0025 * t * t * t / 3, 0.02 * 0.0025 * t * t * t / 3);
}

TEST(FilterNoise, OfAStepOfOdometryIsSharedByItsParts) {
  for (const bool samples : {false, true}) {
    Random random(4);
    const Matrix6 covariance = spread_covariance(random, 1e-3);
    PoseFilter filter(noiseless_space());
    filter.start(0, {}, 1e-18 * Matrix6::Identity());
    filter.add(Odometry{0, 1, {}, covariance});
    if (samples)
      for (int i = 0; i < 100; ++i) filter.add(still_sample(0.01 * i));
    // The gyroscope replaces the rotation of the step.
    for (const double t : {0.25, 1.0}) {
      const Matrix6 found = filter.at(t)->covariance;
      EXPECT_NEAR(found(4, 4), t * covariance(4, 4), 1e-3 * t * covariance(4, 4));
      EXPECT_NEAR(found(0, 0), samples ? 0 : t * covariance(0, 0), 1e-3 * covariance(0, 0));
    }
  }
}

TEST(FilterNoise, AnImageAfterRestCorrectsVelocityAndBiases) {
  // Kalman filter of one axis: x = v t from v of variance s^2, or the same with a bias.
  const double t = 0.5, image = 1e-4;
  const Matrix6 covariance = image * image * Matrix6::Identity();
  Vector6 off;
  off << 2e-4, -1e-4, 3e-4, 1e-3, -2e-3, 3e-3;
  PoseFilterOptions options = noiseless_space();
  options.start_speed_sigma_m_s = 0.01;
  options.start_turn_sigma_rad_s = 0.002;
  PoseFilter filter(options);
  filter.start(0, {}, 1e-18 * Matrix6::Identity());
  ASSERT_TRUE(filter.add(PoseObservation::of_pose(t, perturb({}, off), covariance)).accepted());
  for (int i = 0; i < 6; ++i) {
    const double prior = std::pow(i < 3 ? 0.002 : 0.01, 2);
    const double gain = prior * t / (prior * t * t + image * image);
    EXPECT_NEAR(filter.at(t)->velocity[i], gain * off[i], 2e-3 * gain * off.norm()) << i;
    EXPECT_NEAR(filter.at(t)->velocity_covariance(i, i), prior * (1 - gain * t),
                1e-2 * prior * (1 - gain * t))
        << i;
  }
  options = noiseless_space();
  options.start_speed_sigma_m_s = options.start_turn_sigma_rad_s = 1e-9;
  options.gyro_bias_sigma = 0.002;
  options.accelerometer_bias_sigma = 0.05;
  options.gravity_m_s2.setZero();
  PoseFilter biased(options);
  biased.start(0, {}, 1e-18 * Matrix6::Identity());
  for (int i = 0; i < 50; ++i) biased.add(still_sample(0.01 * i));
  ASSERT_TRUE(biased.add(PoseObservation::of_pose(t, perturb({}, off), covariance)).accepted());
  for (int i = 0; i < 3; ++i) {
    // body_from_world rotates by the bias that is subtracted from the rate, and moves by that
    // subtracted from the acceleration.
    const double turn = std::pow(0.002, 2), push = std::pow(0.05, 2), reach = t * t / 2;
    const double turn_gain = turn * t / (turn * t * t + image * image);
    const double push_gain = push * reach / (push * reach * reach + image * image);
    const PoseEstimate end = *biased.at(t);
    EXPECT_NEAR(end.gyro_bias_rad_s[i], turn_gain * off[i], 0.02 * turn_gain * 3e-4) << i;
    EXPECT_NEAR(end.accelerometer_bias_m_s2[i], push_gain * off[3 + i], 0.02 * push_gain * 4e-3)
        << i;
  }
}

}  // namespace
}  // namespace occ
