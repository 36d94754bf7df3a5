// SPDX-License-Identifier: Apache-2.0
// PlanarFilter: order of arrival, consistency, rejected input.
#include "libocc/track/planar_filter.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

const Eigen::Matrix3d start_covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-4).asDiagonal();
const Eigen::Matrix3d step_covariance = Eigen::Vector3d(4e-6, 1e-6, 1e-6).asDiagonal();
const Rigid3 mounted = look_at({0.1, -0.05, 0.3}, {0.1, -0.05, 1}, {0, 1, 0});

Eigen::Vector3d noise(Random& random, const Eigen::Matrix3d& covariance) {
  return covariance.llt().matrixL() * test::random_vector(random);
}

/// Simulates a driving vehicle with its odometry and images.
struct Drive {
  std::vector<PlanarPose> truth;  // one for each 0.1 s
  std::vector<PlanarOdometry> wheels;
  std::vector<PoseObservation> images;
};

Drive drive(std::uint64_t seed, int steps, double image_sigma = 5e-3) {
  Random random(seed);
  Drive out;
  out.truth.push_back({1, 1, 0.3});
  for (int i = 0; i < steps; ++i) {
    const PlanarPose told = arc(0.05, 0.06 * std::sin(0.1 * i));
    const Eigen::Vector3d error = noise(random, step_covariance);
    const PlanarPose moved{told.x_m + error.x(), told.y_m + error.y(),
                           told.heading_rad + error.z()};
    out.truth.push_back(out.truth.back() * moved);
    out.wheels.push_back({0.1 * i, 0.1 * (i + 1), told, step_covariance});
    const Matrix6 covariance = image_sigma * image_sigma * Matrix6::Identity();
    Vector6 off;
    for (double& value : off) value = image_sigma * random.normal();
    const Rigid3 seen = mounted * body_from_world(out.truth.back(), 0.2);
    out.images.push_back(
        PoseObservation::of_pose(0.1 * (i + 1), perturb(seen, off), covariance, mounted));
  }
  return out;
}

PlanarFilterOptions options() {
  PlanarFilterOptions options;
  options.height_m = 0.2;
  return options;
}

PlanarFilter started(const Drive& d, Random& random) {
  PlanarFilter filter(options());
  const Eigen::Vector3d off = noise(random, start_covariance);
  filter.start(
      0, {d.truth[0].x_m + off.x(), d.truth[0].y_m + off.y(), d.truth[0].heading_rad + off.z()},
      start_covariance);
  return filter;
}

double nees(const PlanarEstimate& estimate, const PlanarPose& truth) {
  const Eigen::Vector3d error = difference(estimate.pose, truth);
  return test::nees(error, estimate.covariance);
}

TEST(PlanarFilter, ErrorsAreAsLargeAsItSays) {
  double sum = 0, nis = 0;
  int count = 0, nis_dof = 0;
  for (std::uint64_t run = 0; run < 100; ++run) {
    const Drive d = drive(run, 60);
    Random random(1000 + run);
    PlanarFilter filter = started(d, random);
    for (std::size_t i = 0; i < d.wheels.size(); ++i) {
      EXPECT_TRUE(filter.add(d.wheels[i]).accepted());
      if (i % 3 != 2) continue;
      const FilterUpdate update = filter.add(d.images[i]);
      EXPECT_TRUE(update.accepted());
      nis += update.nis;
      nis_dof += update.nis_dof;
    }
    sum += nees(*filter.at(6), d.truth.back());
    ++count;
  }
  // 95 % intervals of chi-square divided by its 300 and 6000 degrees of freedom.
  EXPECT_NEAR(sum / (3 * count), 1, 1.96 * std::sqrt(2.0 / 300));
  EXPECT_EQ(nis_dof, 6000);
  EXPECT_NEAR(nis / nis_dof, 1, 1.96 * std::sqrt(2.0 / 6000));
}

TEST(PlanarFilter, ImagesWithoutOdometryAreFollowedAtConstantVelocity) {
  Random random(5);
  PlanarFilter filter(options());
  const PlanarPose from{0, 0, 1};
  filter.start(0, from, start_covariance);
  PlanarPose truth;
  for (int i = 1; i <= 100; ++i) {
    truth = from * arc(0.5 * 0.05 * i, 0.2 * 0.05 * i);
    const Matrix6 covariance = 1e-6 * Matrix6::Identity();
    EXPECT_TRUE(filter
                    .add(PoseObservation::of_pose(0.05 * i, mounted * body_from_world(truth, 0.2),
                                                  covariance, mounted))
                    .accepted());
  }
  const PlanarEstimate later = *filter.at(5.2);
  EXPECT_NEAR(later.velocity.x(), 0.5, 0.01);
  EXPECT_NEAR(later.velocity.z(), 0.2, 0.02);
  EXPECT_LT(difference(later.pose, from * arc(0.5 * 5.2, 0.2 * 5.2)).norm(), 0.01);
  EXPECT_GT(later.covariance(0, 0), filter.at(5)->covariance(0, 0));
}

TEST(PlanarFilter, AGyroscopeTellsTheTurnsAndItsBiasIsLearned) {
  Random random(6);
  PlanarFilter filter(options());
  PlanarPose truth{0, 0, 0};
  filter.start(0, truth, start_covariance);
  constexpr double bias = 0.03, dt = 0.01;
  for (int i = 0; i < 1000; ++i) {
    const double rate = std::sin(0.01 * i);
    ImuSample sample;
    sample.time_s = i * dt;
    sample.turn_rate_rad_s.z() = rate + bias + 2e-3 / std::sqrt(dt) * random.normal();
    EXPECT_TRUE(filter.add(sample).accepted());
    // The odometry has no information on rotation.
    const Eigen::Matrix3d weak = Eigen::Vector3d(1e-8, 1e-8, 10).asDiagonal();
    EXPECT_TRUE(filter.add(PlanarOdometry{i * dt, (i + 1) * dt, {0.005, 0, 0}, weak}).accepted());
    truth = truth * arc(0.005, rate * dt);
    if (i % 10 != 9) continue;
    const Matrix6 covariance = 1e-6 * Matrix6::Identity();
    filter.add(PoseObservation::of_pose((i + 1) * dt, mounted * body_from_world(truth, 0.2),
                                        covariance, mounted));
  }
  const PlanarEstimate end = *filter.at(10);
  EXPECT_NEAR(end.gyro_bias_rad_s, bias, 0.003);
  EXPECT_LT(difference(end.pose, truth).norm(), 0.005);
}

TEST(PlanarFilter, WhatArrivesLateCountsAsIfItHadNot) {
  const Drive d = drive(7, 15);
  Random a(1), b(1);
  PlanarFilter ordered = started(d, a), mixed = started(d, b);
  for (std::size_t i = 0; i < 15; ++i) {
    ordered.add(d.wheels[i]);
    ordered.add(d.images[i]);
  }
  // Odometry arrives after the images that follow it; images arrive in reversed groups of three.
  for (std::size_t i = 0; i < 15; i += 3) {
    for (std::size_t k : {i + 2, i, i + 1}) EXPECT_TRUE(mixed.add(d.images[k]).accepted());
    for (std::size_t k : {i + 1, i + 2, i}) EXPECT_TRUE(mixed.add(d.wheels[k]).accepted());
  }
  const PlanarEstimate p = *ordered.at(1.5), q = *mixed.at(1.5);
  EXPECT_LT(difference(p.pose, q.pose).norm(), 1e-12);
  EXPECT_LT((p.covariance - q.covariance).norm(), 1e-12 * p.covariance.norm());
}

TEST(PlanarFilter, AnImageWithinAStepOfOdometryCutsIt) {
  const Drive d = drive(8, 2);
  Random a(1);
  PlanarFilter filter = started(d, a);
  filter.add(d.wheels[0]);
  const PlanarEstimate half = *filter.at(0.05), end = *filter.at(0.1);
  const PlanarPose expected =
      filter.at(0)->pose * planar_exp(planar_log(d.wheels[0].increment) / 2);
  EXPECT_LT(difference(half.pose, expected).norm(), 1e-14);
  EXPECT_LT(half.covariance(2, 2), end.covariance(2, 2));
}

TEST(PlanarFilter, RefusesWhatContradictsIt) {
  const Drive d = drive(9, 30);
  Random a(1);
  PlanarFilter filter = started(d, a);
  for (std::size_t i = 0; i < 30; ++i) {
    filter.add(d.wheels[i]);
    filter.add(d.images[i]);
  }
  const PlanarEstimate before = *filter.at(3);
  PoseObservation lie = d.images[29];
  lie.cam_from_world.translation += Eigen::Vector3d(0.3, 0, 0);
  const FilterUpdate gated = filter.add(lie);
  EXPECT_EQ(gated.outcome, FilterOutcome::gated);
  EXPECT_GT(gated.nis, 1000);
  EXPECT_EQ((filter.at(3)->covariance - before.covariance).norm(), 0);
  EXPECT_EQ(filter.add(d.wheels[25]).outcome, FilterOutcome::overlapping);
  EXPECT_EQ(filter.add(d.images[0]).outcome, FilterOutcome::too_old);
  EXPECT_EQ(filter.add(d.wheels[0]).outcome, FilterOutcome::too_old);
  EXPECT_FALSE(filter.at(0.5));
  EXPECT_TRUE(filter.at(1.5));
}

TEST(PlanarFilter, OneDirectionSeenCorrectsThatDirection) {
  const Drive d = drive(10, 1);
  Random a(1);
  PlanarFilter filter = started(d, a);
  PoseObservation along_x = d.images[0];
  along_x.time_s = 0;
  along_x.cam_from_world = mounted * body_from_world(d.truth[0], 0.2);
  const Eigen::RowVector3d x_in_cam = along_x.cam_from_world.rotation.col(0).transpose();
  along_x.information.setZero();
  along_x.information.bottomRightCorner<3, 3>() = 1e8 * x_in_cam.transpose() * x_in_cam;
  const FilterUpdate update = filter.add(along_x);
  EXPECT_TRUE(update.accepted());
  EXPECT_EQ(update.nis_dof, 1);
  EXPECT_NEAR(filter.at(0)->pose.x_m, d.truth[0].x_m, 1e-4);
  // Tilt and heading move the camera, which stands 0.3 m above the body and 0.1 m before it.
  EXPECT_LT(filter.at(0)->covariance(0, 0), 1e-6);
  // The position along y is determined by the heading only, through the lever arm of the camera.
  EXPECT_NEAR(filter.at(0)->covariance(1, 1), 1e-4, 1e-6);
}

TEST(PlanarFilter, ThrowsForWhatIsNotNumbers) {
  PlanarFilter filter;
  EXPECT_FALSE(filter.started());
  EXPECT_FALSE(filter.at(0));
  EXPECT_EQ(filter.add(PlanarOdometry{0, 1, {}, step_covariance}).outcome,
            FilterOutcome::not_started);
  EXPECT_THROW(filter.start(0, {}, Eigen::Matrix3d::Zero()), std::invalid_argument);
  EXPECT_THROW(filter.start(std::nan(""), {}, start_covariance), std::invalid_argument);
  filter.start(0, {}, start_covariance);
  EXPECT_THROW(filter.add(PlanarOdometry{1, 1, {}, step_covariance}), std::invalid_argument);
  EXPECT_THROW(filter.add(PlanarOdometry{0, 1, {std::nan(""), 0, 0}, step_covariance}),
               std::invalid_argument);
  EXPECT_THROW(filter.add(PlanarOdometry{0, 1, {}, -step_covariance}), std::invalid_argument);
  PlanarFilterOptions wrong;
  wrong.gate_sigma = 0;
  EXPECT_THROW(PlanarFilter{wrong}, std::invalid_argument);
}

}  // namespace
}  // namespace occ
