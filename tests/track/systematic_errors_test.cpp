// SPDX-License-Identifier: Apache-2.0
// Systematic errors (consider parameters) of the filters: the error of the state after a thousand
// images with one constant error is that of its covariance.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "libocc/geometry/perturbation.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"

namespace {

using occ::Matrix6;
using occ::PlanarPose;
using occ::PoseObservation;
using occ::Rigid3;
using occ::Vector6;

constexpr int images = 1000, runs = 60;
constexpr double noise_m = 1e-3, noise_rad = 1e-3;

// Mean of 3 * 60 squared normal values: standard deviation 0.105; four of them.
constexpr double min_nees = 0.58, max_nees = 1.42;

Rigid3 mount() {
  return {(Eigen::Matrix3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished(), {0.1, -0.2, -1.5}};
}

PoseObservation observed(double time_s, const Rigid3& cam_from_world, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Vector6 sigmas;
  sigmas << Eigen::Vector3d::Constant(noise_rad), Eigen::Vector3d::Constant(noise_m);
  Vector6 noise;
  for (double& value : noise) value = normal(random);
  return PoseObservation::of_pose(time_s,
                                  perturb(cam_from_world, Vector6(sigmas.cwiseProduct(noise))),
                                  sigmas.cwiseAbs2().asDiagonal(), mount());
}

void add_errors(const Matrix6& sigmas, PoseObservation& seen) {
  seen.gradient_by_systematic = seen.information * sigmas;
  seen.systematic = {3, 4, 5, 6, 7, 8};
}

Matrix6 mount_sigmas() {
  Vector6 sigmas;
  sigmas << 4e-3, 4e-3, 4e-3, 5e-3, 5e-3, 5e-3;
  return sigmas.asDiagonal();
}

struct Drive {
  double nees = 0, variance_m2 = 0;
};

/// Drives in a circle, with a constant error of the mount or of the clock. The velocity that the
/// effect of the clock is computed from is exact, or that of an odometry of this standard deviation
/// after a second.
Drive drive(int seed, bool has_mount_error, double clock_sigma_s, bool is_stated,
            double odometry_sigma = 0) {
  std::mt19937_64 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  Vector6 unit;
  for (double& value : unit) value = normal(random);
  const Vector6 off = has_mount_error ? Vector6(mount_sigmas() * unit) : Vector6(Vector6::Zero());
  const double late_s = clock_sigma_s * normal(random);
  const Eigen::Vector3d velocity(0.5, 0, 0.3);
  occ::PlanarFilterOptions options;
  options.gate_sigma = INFINITY;
  occ::PlanarFilter filter(options);
  const PlanarPose begin{1, 2, 0.3};
  filter.start(0, begin, Eigen::Matrix3d::Identity());
  const bool is_measured = odometry_sigma > 0;
  const double dt = 0.05, sigma = is_measured ? odometry_sigma : 1e-3;
  for (int i = 1; i <= images; ++i) {
    PlanarPose step = occ::planar_exp(velocity * dt);
    step.x_m += sigma * std::sqrt(dt) * normal(random);
    step.y_m += sigma * std::sqrt(dt) * normal(random);
    step.heading_rad += sigma * std::sqrt(dt) * normal(random);
    filter.add(occ::PlanarOdometry{dt * (i - 1), dt * i, step,
                                   sigma * sigma * dt * Eigen::Matrix3d::Identity()});
    const PlanarPose truth = begin * occ::planar_exp(velocity * (dt * i + late_s));
    const Rigid3 body = body_from_world(truth);
    Vector6 tilt = Vector6::Zero();
    tilt << 1e-3 * normal(random), 1e-3 * normal(random), 0, 0, 0, 1e-3 * normal(random);
    PoseObservation seen = observed(dt * i, perturb(mount() * perturb(body, tilt), off), random);
    if (is_stated && has_mount_error) add_errors(mount_sigmas(), seen);
    if (is_stated && clock_sigma_s > 0) {
      Vector6 rate;
      const Eigen::Vector3d v = is_measured ? planar_log(step) / dt : velocity;
      rate << 0, 0, -v[2], -v[0], -v[1], 0;
      seen.systematic = {0};
      seen.uncertain_systematic = is_measured ? 1 : 0;
      seen.gradient_by_systematic = seen.information * occ::adjoint(mount()) * rate * clock_sigma_s;
    }
    filter.add(seen);
  }
  const auto last = filter.at(dt * images);
  const Eigen::Vector3d error =
      difference(last->pose, begin * occ::planar_exp(velocity * (dt * images)));
  return {error.dot(last->covariance.inverse() * error) / 3,
          last->covariance.topLeftCorner<2, 2>().trace()};
}

double mean_nees(bool has_mount_error, double clock_sigma_s, bool is_stated) {
  double sum = 0;
  for (int seed = 0; seed < runs; ++seed)
    sum += drive(seed, has_mount_error, clock_sigma_s, is_stated).nees;
  return sum / runs;
}

TEST(SystematicErrors, PlanarFilterIsConsistentAfterManyImages) {
  EXPECT_GT(mean_nees(true, 0, false), 5);
  const double mount_nees = mean_nees(true, 0, true), clock_nees = mean_nees(false, 0.02, true);
  EXPECT_GT(mount_nees, min_nees);
  EXPECT_LT(mount_nees, max_nees);
  EXPECT_GT(clock_nees, min_nees);
  EXPECT_LT(clock_nees, max_nees);
}

// A clock error times a measured velocity varies by the noise of the velocity. That does not
// determine the clock.
TEST(SystematicErrors, AMeasuredVelocityDoesNotDetermineTheClock) {
  double sum = 0;
  for (int seed = 0; seed < runs; ++seed) sum += drive(seed, false, 0.02, true, 5e-3).nees;
  EXPECT_GT(sum / runs, min_nees);
  EXPECT_LT(sum / runs, max_nees);
}

TEST(SystematicErrors, CovarianceOfTheClockDoesNotFallBelowItsPart) {
  const double along_m = 0.5 * 0.02;
  EXPECT_GT(drive(1, false, 0.02, true).variance_m2, 0.5 * along_m * along_m);
  EXPECT_LT(drive(1, false, 0.02, false).variance_m2, 0.01 * along_m * along_m);
}

TEST(SystematicErrors, PoseFilterIsConsistentAtRest) {
  double sum = 0;
  for (int seed = 0; seed < runs; ++seed) {
    std::mt19937_64 random(static_cast<unsigned>(seed));
    std::normal_distribution<double> normal;
    Vector6 unit;
    for (double& value : unit) value = normal(random);
    const Rigid3 body{Eigen::Matrix3d::Identity(), {1, 2, 3}};
    occ::PoseFilterOptions options;
    options.gate_sigma = INFINITY;
    occ::PoseFilter filter(options);
    filter.start(0, body, Matrix6::Identity());
    for (int i = 1; i <= images / 5; ++i) {
      PoseObservation seen =
          observed(0.05 * i, perturb(mount() * body, Vector6(mount_sigmas() * unit)), random);
      add_errors(mount_sigmas(), seen);
      filter.add(seen);
    }
    const auto last = filter.at(0.05 * (images / 5));
    const Vector6 error = difference(last->body_from_world, body);
    sum += error.dot(last->covariance.inverse() * error) / 6;
  }
  EXPECT_GT(sum / runs, 0.7);
  EXPECT_LT(sum / runs, 1.3);
}

TEST(SystematicErrors, AnOutlierIsRejectedAndChangesNothing) {
  const Rigid3 body{Eigen::Matrix3d::Identity(), {1, 2, 3}};
  std::mt19937_64 random(2);
  occ::PoseFilter filter, untouched;
  filter.start(0, body, 1e-4 * Matrix6::Identity());
  untouched.start(0, body, 1e-4 * Matrix6::Identity());
  PoseObservation outlier = observed(0.1, mount() * Rigid3{body.rotation, {1, 2, 4}}, random);
  add_errors(mount_sigmas(), outlier);
  const occ::FilterUpdate update = filter.add(outlier);
  EXPECT_FALSE(update.accepted());
  EXPECT_GT(update.nis, 50);
  const auto after = filter.at(0.1), before = untouched.at(0.1);
  EXPECT_LT(difference(after->body_from_world, before->body_from_world).norm(), 1e-12);
  EXPECT_TRUE(after->covariance.isApprox(before->covariance, 1e-12));
}

TEST(SystematicErrors, ErrorsOfVarianceZeroChangeNothing) {
  const Rigid3 body{Eigen::Matrix3d::Identity(), {1, 2, 3}};
  std::mt19937_64 random(1);
  PoseObservation seen = observed(0.1, mount() * body, random);
  occ::PoseFilter plain, stated;
  plain.start(0, body, 1e-4 * Matrix6::Identity());
  stated.start(0, body, 1e-4 * Matrix6::Identity());
  const auto exact = plain.add(seen);
  add_errors(Matrix6::Zero(), seen);
  EXPECT_NEAR(stated.add(seen).nis, exact.nis, 1e-9);
  EXPECT_TRUE(stated.at(0.1)->covariance.isApprox(plain.at(0.1)->covariance, 1e-9));
  EXPECT_TRUE(seen.without_systematic().information.isApprox(seen.information, 1e-9));
}

}  // namespace
