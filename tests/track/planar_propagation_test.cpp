// SPDX-License-Identifier: Apache-2.0
// Covariances of PlanarFilter: numerical derivatives of its prediction, the closed form of white
// noise that is integrated, and the Kalman filter of textbooks for one image.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/track/planar_filter.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;

PlanarFilterOptions noiseless_floor() {
  PlanarFilterOptions o;
  o.height_m = 0.3;
  o.acceleration_noise = o.lateral_noise = o.turn_acceleration_noise = 0;
  o.gyro_noise = o.gyro_bias_walk = 0;
  o.gyro_bias_sigma = 1e-9;
  return o;
}

ImuSample no_turn(double time_s) {
  ImuSample sample;
  sample.time_s = time_s;
  return sample;
}

PlanarPose shifted(const PlanarPose& pose, const Eigen::Vector3d& off) {
  return {pose.x_m + off[0], pose.y_m + off[1], pose.heading_rad + off[2]};
}

struct FloorInput {
  bool gyro = false, wheels = false;
};

constexpr double floor_time_s = 0.4;

/// Filter of a vehicle that moves at time 0. `off`: changes of pose, velocity and bias at time 0.
PlanarFilter moving_vehicle(const PlanarFilterOptions& options, FloorInput input,
                            const Vector7& off, const Eigen::Matrix3d& start,
                            const Eigen::Matrix3d& step) {
  const PlanarPose increment =
      planar_exp((Eigen::Vector3d(1.2, 0.4, 1.1) + off.segment<3>(3)) / 10);
  PlanarFilter filter(options);
  filter.start(-0.1, shifted({1, 2, 0.8}, off.head<3>()) * increment.inverse(), start);
  filter.add(PlanarOdometry{-0.1, 0, increment, step});
  if (input.wheels)
    filter.add(
        PlanarOdometry{0, floor_time_s, {0.5, 0.1, -0.3}, 1e-24 * Eigen::Matrix3d::Identity()});
  for (int i = 0; input.gyro && 0.01 * i < floor_time_s; ++i) {
    ImuSample sample;
    sample.time_s = 0.01 * i;
    sample.turn_rate_rad_s.z() = 0.9 + i * 0.01 - off[6];
    filter.add(sample);
  }
  return filter;
}

const Eigen::Matrix3d tiny3 = 1e-20 * Eigen::Matrix3d::Identity();

TEST(PlanarPropagation, FollowsTheDerivativesOfThePrediction) {
  Eigen::Matrix3d root;
  root << 1, 0.2, -0.4, 0.3, 0.8, 0.1, -0.2, 0.5, 1.3;
  for (const FloorInput input : {FloorInput{false, false}, FloorInput{true, false},
                                 FloorInput{false, true}, FloorInput{true, true}}) {
    const auto end = [&](const Eigen::VectorXd& off) {
      const PlanarEstimate e =
          *moving_vehicle(noiseless_floor(), input, off, tiny3, tiny3).at(floor_time_s);
      Eigen::VectorXd out(6);
      out << e.pose.x_m, e.pose.y_m, e.pose.heading_rad, e.velocity;
      return out;
    };
    const Eigen::MatrixXd jacobian = test::numerical_jacobian(end, Eigen::VectorXd::Zero(7), 1e-5);
    for (int source = 0; source < 3; ++source) {
      PlanarFilterOptions options = noiseless_floor();
      const Eigen::Matrix3d start = source == 0 ? 1e-4 * root * root.transpose() : tiny3;
      const Eigen::Matrix3d step = source == 1 ? 1e-6 * root * root.transpose() : tiny3;
      if (source == 2) options.gyro_bias_sigma = 0.1;
      const PlanarFilter filter = moving_vehicle(options, input, Vector7::Zero(), start, step);
      Eigen::MatrixXd before = Eigen::MatrixXd::Zero(7, 7);
      before.topLeftCorner<3, 3>() = filter.at(0)->covariance;
      before.block<3, 3>(3, 3) = step / (0.1 * 0.1);
      before(6, 6) = std::pow(options.gyro_bias_sigma, 2);
      const Eigen::MatrixXd after = jacobian * before * jacobian.transpose();
      const Eigen::Matrix3d pose = after.topLeftCorner<3, 3>(),
                            speed = after.bottomRightCorner<3, 3>();
      const PlanarEstimate found = *filter.at(floor_time_s);
      EXPECT_LT((found.covariance - pose).norm(), 0.03 * pose.norm() + 1e-12)
          << "gyro " << input.gyro << " wheels " << input.wheels << " source " << source;
      EXPECT_LT((found.velocity_covariance - speed).norm(), 0.03 * speed.norm() + 1e-12)
          << "gyro " << input.gyro << " wheels " << input.wheels << " source " << source;
    }
  }
}

TEST(PlanarPropagation, OdometrysNoiseIsAlongTheAxesBeforeTheStep) {
  const PlanarPose from{1, 2, 0.8}, increment{0.6, -0.2, 0.5};
  Eigen::Matrix3d noise;
  noise << 4, 1, 0.5, 1, 2, -0.3, 0.5, -0.3, 1;
  noise *= 1e-6;
  PlanarFilter filter(noiseless_floor());
  filter.start(0, from, tiny3);
  filter.add(PlanarOdometry{0, 1, increment, noise});
  const auto end = [&](const Eigen::VectorXd& off) {
    const PlanarPose pose = from * shifted(increment, Eigen::Vector3d(off));
    return Eigen::VectorXd(Eigen::Vector3d(pose.x_m, pose.y_m, pose.heading_rad));
  };
  const Eigen::MatrixXd jacobian = test::numerical_jacobian(end, Eigen::VectorXd::Zero(3));
  const Eigen::Matrix3d expected = jacobian * noise * jacobian.transpose();
  EXPECT_LT((filter.at(1)->covariance - expected).norm(), 1e-6 * expected.norm());
  EXPECT_LT((filter.at(1)->velocity - planar_log(increment)).norm(), 1e-12);
  // A quarter of the step has a quarter of the variance, here of the heading.
  EXPECT_NEAR(filter.at(0.25)->covariance(2, 2), noise(2, 2) / 4, 1e-9 * noise(2, 2));
  // With a gyroscope, the rotation of the wheels is not used.
  for (int i = 0; i < 100; ++i) filter.add(no_turn(0.01 * i));
  EXPECT_LT(filter.at(1)->covariance(2, 2), 1e-3 * noise(2, 2));
  const Eigen::Rotation2Dd turn(0.8);
  const Eigen::Matrix2d across =
      turn.toRotationMatrix() * noise.topLeftCorner<2, 2>() * turn.toRotationMatrix().transpose();
  EXPECT_GT(filter.at(1)->covariance(0, 0), 0.5 * across(0, 0));
}

PlanarFilter stopped_vehicle(PlanarFilterOptions options, double heading_rad) {
  options.start_speed_sigma_m_s = options.start_turn_sigma_rad_s = 1e-9;
  PlanarFilter filter(options);
  filter.start(0, {1, 2, heading_rad}, tiny3);
  return filter;
}

TEST(PlanarPropagation, WhiteAccelerationIsIntegratedTwice) {
  PlanarFilterOptions options = noiseless_floor();
  options.acceleration_noise = 0.5;
  options.lateral_noise = 0.2;
  options.turn_acceleration_noise = 0.3;
  const double t = 1.5, q[] = {0.25, 0.04, 0.09};
  const PlanarEstimate end = *stopped_vehicle(options, 0.8).at(t);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(end.velocity_covariance(i, i), q[i] * t, 1e-6 * t) << i;
  Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(0.8).toRotationMatrix();
  expected.topLeftCorner<2, 2>() =
      turn * Eigen::Vector2d(q[0], q[1]).asDiagonal() * turn.transpose();
  expected(2, 2) = q[2];
  expected *= t * t * t / 3;
  EXPECT_LT((end.covariance - expected).norm(), 1e-6 * expected.norm());
  PlanarFilter turning = stopped_vehicle(options, 0.8);  // a gyroscope replaces the turns
  for (int i = 0; i < 150; ++i) turning.add(no_turn(0.01 * i));
  EXPECT_LT(turning.at(t)->covariance(2, 2), 1e-9);
  EXPECT_NEAR(turning.at(t)->covariance(0, 0), expected(0, 0), 1e-3 * expected(0, 0));
}

TEST(PlanarPropagation, NoiseOfTheGyroscopeIsIntegrated) {
  const double t = 1;
  PlanarFilterOptions options = noiseless_floor();
  options.gyro_noise = 0.01;
  options.gyro_bias_walk = 0.02;
  PlanarFilter filter = stopped_vehicle(options, 0.8);
  for (int i = 0; i < 100; ++i) filter.add(no_turn(0.01 * i));
  const double expected = 1e-4 * t + 4e-4 * t * t * t / 3;
  EXPECT_NEAR(filter.at(t)->covariance(2, 2), expected, 0.02 * expected);
}

/// Prior of a vehicle at rest after a time: pose, and covariance of pose and velocity.
struct Rest {
  PlanarPose pose{1, 2, 0.8};
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// The textbook's Kalman update with an image of covariance `image` (left perturbation of
/// body_from_world), which also scatters by the roll, pitch and height of the floor.
TEST(PlanarPropagation, AnImageIsWeighedAsInTextbooks) {
  PlanarFilterOptions options = noiseless_floor();
  options.start_speed_sigma_m_s = 0.03;
  options.start_turn_sigma_rad_s = 0.02;
  options.tilt_sigma_rad = 4e-3;
  options.height_sigma_m = 6e-3;
  Eigen::Matrix3d root, start;
  root << 1, 0.2, -0.4, 0.3, 0.8, 0.1, -0.2, 0.5, 1.3;
  start = 2.5e-5 * root * root.transpose();
  Rest rest;
  const double t = 0.5;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(0.8).toRotationMatrix();
  const Eigen::Matrix3d speed = Eigen::Vector3d(9e-4, 9e-4, 4e-4).asDiagonal();
  rest.covariance << start + t * t * turn * speed * turn.transpose(), t * turn * speed,
      t * speed * turn.transpose(), speed;
  Random random(2);
  Matrix6 image_root = 2e-3 * Matrix6::Identity();
  for (double& value : image_root.reshaped()) value += 1e-3 * random.normal();
  const Matrix6 image = image_root * image_root.transpose();
  // Derivatives of body_from_world by x, y, heading, roll, pitch, height.
  const Rigid3 expected = body_from_world(rest.pose, options.height_m);
  const auto moved = [&](const Eigen::VectorXd& off) {
    const PlanarPose pose = shifted(rest.pose, off.head<3>());
    const Rigid3 tilt{so3_exp({off[3], off[4], 0}), Eigen::Vector3d::Zero()};
    const Rigid3 body = tilt * body_from_world(pose, options.height_m + off[5]);
    return Eigen::VectorXd(difference(body, expected));
  };
  const Eigen::MatrixXd by = test::numerical_jacobian(moved, Eigen::VectorXd::Zero(6));
  const Eigen::MatrixXd along = by.leftCols<3>(), across = by.rightCols<3>();
  const Eigen::Vector3d floor = Eigen::Vector3d(4e-3, 4e-3, 6e-3).cwiseAbs2();
  const Matrix6 total = image + across * floor.asDiagonal() * across.transpose();
  const Eigen::Matrix3d noise = (along.transpose() * total.inverse() * along).inverse();
  Vector6 off;
  off << 1e-3, -2e-3, 4e-3, 3e-3, 5e-3, -4e-3;
  const Eigen::Vector3d seen = noise * along.transpose() * total.inverse() * off;
  const Eigen::Matrix3d innovation = rest.covariance.topLeftCorner<3, 3>() + noise;
  const Eigen::Matrix<double, 6, 3> gain = rest.covariance.leftCols<3>() * innovation.inverse();
  const Eigen::Matrix<double, 6, 1> step = gain * seen;
  const Eigen::Matrix<double, 6, 6> after = rest.covariance - gain * rest.covariance.topRows<3>();

  const Rigid3 mounted = look_at({0.1, -0.05, 0.3}, {0.1, 0.5, 1}, {0, 1, 0});
  for (const bool with_camera : {false, true}) {
    PlanarFilter filter(options);
    filter.start(0, rest.pose, start);
    PoseObservation body = PoseObservation::of_pose(t, perturb(expected, off), image);
    PoseObservation observation = body;
    if (with_camera) {  // the same information about the pose of a mounted camera
      const Matrix6 to_camera = adjoint(mounted);
      const Matrix6 as_camera = to_camera * image * to_camera.transpose();
      observation = PoseObservation::of_pose(t, mounted * perturb(expected, off),
                                             0.5 * (as_camera + as_camera.transpose()), mounted);
    }
    const FilterUpdate update = filter.add(observation);
    ASSERT_TRUE(update.accepted());
    EXPECT_EQ(update.nis_dof, 3);
    EXPECT_NEAR(update.nis, seen.dot(innovation.inverse() * seen), 0.02 * update.nis);
    const PlanarEstimate found = *filter.at(t);
    const double size = step.head<3>().norm();
    EXPECT_LT((difference(found.pose, rest.pose) - step.head<3>()).norm(), 0.02 * size);
    EXPECT_LT((found.velocity - step.tail<3>()).norm(), 0.02 * step.tail<3>().norm());
    const Eigen::Matrix3d pose = after.topLeftCorner<3, 3>(),
                          speeds = after.bottomRightCorner<3, 3>();
    EXPECT_LT((found.covariance - pose).norm(), 1e-3 * pose.norm());
    EXPECT_LT((found.velocity_covariance - speeds).norm(), 1e-3 * speeds.norm());
  }
}

TEST(PlanarPropagation, AnImageCorrectsTheBiasOfTheGyroscope) {
  PlanarFilterOptions options = noiseless_floor();
  options.gyro_bias_sigma = 0.01;
  options.tilt_sigma_rad = options.height_sigma_m = 1e-9;
  PlanarFilter filter = stopped_vehicle(options, 0.8);
  for (int i = 0; i < 100; ++i) filter.add(no_turn(0.01 * i));
  const double turned = 0.004, image = 1e-3;
  filter.add(PoseObservation::of_pose(1, body_from_world({1, 2, 0.8 + turned}, 0.3),
                                      image * image * Matrix6::Identity()));
  // The vehicle has turned although the gyroscope reads zero: the bias is negative.
  const double gain = 1e-4 / (1e-4 + image * image);
  EXPECT_NEAR(filter.at(1)->gyro_bias_rad_s, -gain * turned, 1e-2 * turned);
}

TEST(PlanarPropagation, ThePoseInSpaceFollowsFromThatOnTheFloor) {
  PlanarFilterOptions options = noiseless_floor();
  options.tilt_sigma_rad = 4e-3;
  options.height_sigma_m = 6e-3;
  Eigen::Matrix3d root, start;
  root << 1, 0.2, -0.4, 0.3, 0.8, 0.1, -0.2, 0.5, 1.3;
  start = 1e-4 * root * root.transpose();
  const PlanarFilter filter = moving_vehicle(options, {}, Vector7::Zero(), start, 0.01 * start);
  const PlanarEstimate estimate = *filter.at(0.2);
  const PosePrediction found = *filter.predict(0.2);
  const Rigid3 expected = body_from_world(estimate.pose, 0.3);
  EXPECT_LT(difference(found.body_from_world, expected).norm(), 1e-12);
  const auto moved = [&](const Eigen::VectorXd& off) {
    const Rigid3 tilt{so3_exp({off[3], off[4], 0}), Eigen::Vector3d::Zero()};
    const Rigid3 body = tilt * body_from_world(shifted(estimate.pose, off.head<3>()), 0.3 + off[5]);
    return Eigen::VectorXd(difference(body, expected));
  };
  const Eigen::MatrixXd by = test::numerical_jacobian(moved, Eigen::VectorXd::Zero(6));
  Matrix6 prior = Matrix6::Zero();
  prior.topLeftCorner<3, 3>() = estimate.covariance;
  prior.diagonal().tail<3>() << 1.6e-5, 1.6e-5, 3.6e-5;
  const Matrix6 covariance = by * prior * by.transpose();
  EXPECT_LT((found.covariance - covariance).norm(), 1e-6 * covariance.norm());
  // Velocity: the pose a moment later; its covariance: from that of the vehicle's velocity.
  const double h = 1e-5;
  const Vector6 rate = difference(filter.predict(0.2 + h)->body_from_world, expected) / h;
  EXPECT_LT((found.velocity - rate).norm(), 1e-3 * rate.norm());
  const auto rate_of = [](const Eigen::VectorXd& v) {
    const double step = 1e-4;
    return Eigen::VectorXd(
        difference(body_from_world(planar_exp(Eigen::Vector3d(step * v))), Rigid3{}) / step);
  };
  const Eigen::MatrixXd by_speed = test::numerical_jacobian(rate_of, estimate.velocity, 1e-3);
  const Matrix6 speeds = by_speed * estimate.velocity_covariance * by_speed.transpose();
  EXPECT_LT((found.velocity_covariance - speeds).norm(), 1e-2 * speeds.norm());
}

}  // namespace
}  // namespace occ
