// SPDX-License-Identifier: Apache-2.0
// Evidence for a pose: its integral, what raises and lowers it, and probabilities.
#include "libocc/pose/internal/evidence.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"

namespace occ::test {
namespace {

using internal::pose::log_determinant;
using internal::pose::PoseEvidence;
using internal::pose::PriorPart;
using internal::pose::probabilities;
using internal::pose::SeenLamp;

double evidence_of(const PoseEvidence& pose) { return internal::pose::log_evidence(pose).value; }

Eigen::Matrix<double, 2, 6> by_pose(double x, double y, double z, double focal_px) {
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << focal_px / z, 0, -focal_px * x / (z * z), 0, focal_px / z, -focal_px * y / (z * z);
  Eigen::Matrix<double, 3, 6> point;
  point << 0, z, -y, 1, 0, 0, -z, 0, x, 0, 1, 0, y, -x, 0, 0, 0, 1;
  return by_point * point;
}

// Lamps 2 to 3 m before a camera of 1000 px focal length, seen with an error of `residual_px`.
PoseEvidence view_of(int lamps, double residual_px = 0, double sigma_px = 0.3) {
  PoseEvidence pose;
  pose.image_px2 = 1e6;
  pose.volume_m3 = 500;
  pose.blobs = lamps;
  for (int i = 0; i < lamps; ++i) {
    SeenLamp lamp;
    const double angle = 2.4 * i, radius = 0.4 + 0.1 * i;
    lamp.by_pose = by_pose(radius * std::cos(angle), radius * std::sin(angle),
                           2.5 + 0.5 * std::cos(3.0 * i), 1000);
    lamp.residual_px = residual_px * Eigen::Vector2d(std::cos(7.0 * i), std::sin(7.0 * i));
    lamp.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
    pose.lamps.push_back(lamp);
  }
  return pose;
}

// Mean over poses of a box of the likelihood of the residuals over that of uniform false lights, by
// sampling. The box holds all poses that count, so the integral over all poses follows.
TEST(Evidence, IsTheMeanLikelihoodOverAllPoses) {
  PoseEvidence pose = view_of(4, 0, 40);  // wide, so that samples meet the peak
  const double turn_rad = 0.4, shift_m = 1.2;
  Random random(7);
  double sum = 0;
  constexpr int samples = 2000000;
  for (int i = 0; i < samples; ++i) {
    Vector6 x;
    for (int k = 0; k < 6; ++k) x[k] = random.uniform(-1, 1) * (k < 3 ? turn_rad : shift_m);
    double chi2 = 0;
    for (const SeenLamp& lamp : pose.lamps)
      chi2 += (lamp.by_pose * x).squaredNorm() / lamp.covariance_px2(0, 0);
    const double length_m = std::cbrt(pose.volume_m3);
    chi2 += x.head<3>().squaredNorm() * 3 / (pi * pi) +
            x.tail<3>().squaredNorm() * 12 / (length_m * length_m);
    sum += std::exp(-0.5 * chi2);
  }
  // Density of the widest poses at their mean.
  const double density = std::pow(3 / (pi * pi) * 12, 1.5) / pose.volume_m3 / std::pow(2 * pi, 3);
  const double box = std::pow(2 * turn_rad, 3) * std::pow(2 * shift_m, 3);
  const double per_lamp = pose.image_px2 / (2 * pi * pose.lamps[0].covariance_px2(0, 0));
  const double places = sum / samples * box * density * std::pow(per_lamp, 4);
  // P(0) 0! / (P(4) 4!), and the beta function of four lamps that are lit.
  const double counts = 0.5 / (24.0 / 30);
  const double lit = (1.0 / 6) / (1.0 / 2);
  EXPECT_NEAR(evidence_of(pose), std::log(places * counts * lit), 0.1);
}

TEST(Evidence, GrowsWithEveryLampThatAgrees) {
  EXPECT_LT(evidence_of(view_of(3)), 3);  // three lamps fit some pose in any case
  double before = evidence_of(view_of(3));
  for (int lamps = 4; lamps < 10; ++lamps) {
    const double evidence = evidence_of(view_of(lamps));
    EXPECT_GT(evidence, before + 5) << lamps;
    before = evidence;
  }
}

TEST(Evidence, FallsWithResidualsMissedLampsAndFalseLights) {
  const double exact = evidence_of(view_of(5));
  double before = exact;
  for (const double residual_px : {1.0, 3.0, 10.0}) {
    const double evidence = evidence_of(view_of(5, residual_px));
    EXPECT_LT(evidence, before - 1) << residual_px;
    before = evidence;
  }
  PoseEvidence pose = view_of(5);
  pose.missed = 2;
  EXPECT_LT(evidence_of(pose), exact - 2);
  pose.missed = 0;
  pose.blobs = 25;
  EXPECT_LT(evidence_of(pose), exact - 10);
}

TEST(Evidence, OfAWrongPriorIsThatWithoutIt) {
  PoseEvidence pose = view_of(5);
  const double without = evidence_of(pose);
  pose.prior = {{1e4 * Matrix6::Identity(), Vector6::Zero(), 0, 1e-4}};
  EXPECT_GT(evidence_of(pose), without + 10);
  pose.prior[0].gradient[0] = 1e5;  // ten radians off, 1000 of its sigmas
  pose.prior[0].chi2 = 1e6;
  EXPECT_NEAR(evidence_of(pose), without + std::log(1e-4), 0.01);
  EXPECT_NEAR(internal::pose::log_evidence(pose).if_prior_wrong, evidence_of(pose), 1e-9);
}

TEST(Evidence, OfAWrongPartKeepsTheOthers) {
  PoseEvidence pose = view_of(5);
  PriorPart height, turn;
  height.information(5, 5) = 1e4;
  turn.information(2, 2) = 1e6;
  pose.prior = {height};
  const double without_turn = evidence_of(pose);
  turn.gradient[2] = 1e6;
  turn.chi2 = 1e6;
  pose.prior = {height, turn};
  EXPECT_NEAR(evidence_of(pose), without_turn + std::log(1e-4), 0.01);
}

TEST(Evidence, NoLampsAreNone) {
  PoseEvidence pose = view_of(3);
  pose.lamps.clear();
  EXPECT_EQ(evidence_of(pose), -infinity);
}

TEST(Evidence, LogDeterminantOfAMatrixOfAnyScale) {
  Matrix6 matrix = Matrix6::Identity();
  matrix.diagonal() << 1e-200, 1e-200, 1e-200, 1, 4, 1e100;
  EXPECT_NEAR(log_determinant(matrix), std::log(4.0) - 500 * std::log(10.0), 1e-9);
}

TEST(Evidence, ProbabilitiesSumToOneAtAnyScale) {
  for (const double scale : {1.0, 1e3, 1e6}) {
    const std::vector<double> shares = probabilities({scale, scale - 1, -scale});
    ASSERT_EQ(shares.size(), 4u);
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1, 1e-12);
    EXPECT_NEAR(shares[1] / shares[0], std::exp(-1), 1e-9);
  }
  EXPECT_DOUBLE_EQ(probabilities({-infinity}).back(), 1);
  EXPECT_NEAR(probabilities({0.0}).back(), 0.5, 1e-15);
}

// ln of the density of normal residuals with this covariance at zero.
double log_normal(const Eigen::VectorXd& residual, const Eigen::MatrixXd& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  const Eigen::VectorXd white = root.matrixL().solve(residual);
  const double log_root = Eigen::VectorXd(root.matrixLLT().diagonal()).array().log().sum();
  const auto count = static_cast<double>(residual.size());
  return -0.5 * white.squaredNorm() - log_root - 0.5 * count * std::log(2 * pi);
}

// Mean and covariance of the poses before their places are compared.
struct Poses {
  Vector6 mean = Vector6::Zero();
  Matrix6 covariance = Matrix6::Zero();

  // Uniform rotations have a variance of pi^2 / 3 about each axis, a uniform place in a cube a
  // twelfth of its squared side.
  explicit Poses(const PoseEvidence& pose) {
    const double length_m = std::cbrt(pose.volume_m3);
    covariance.diagonal() << Eigen::Vector3d::Constant(pi * pi / 3 *
                                                       std::pow(pose.rotations, 2.0 / 3)),
        Eigen::Vector3d::Constant(length_m * length_m / 12);
  }
  // Kalman update by residual + by_pose * x of the given covariance.
  void add(const Eigen::VectorXd& residual, const Eigen::MatrixXd& by_pose,
           const Eigen::MatrixXd& noise) {
    const Eigen::MatrixXd s = by_pose * covariance * by_pose.transpose() + noise;
    const Eigen::MatrixXd gain = covariance * by_pose.transpose() * s.inverse();
    mean -= gain * (residual + by_pose * mean);
    covariance -= gain * by_pose * covariance;
  }
};

// ln of the density of all places of lamps and corners, jointly normal by the poses before.
double log_joint_places(const PoseEvidence& pose, const Poses& before) {
  std::vector<SeenLamp> all = pose.lamps;
  all.insert(all.end(), pose.corners.begin(), pose.corners.end());
  const auto count = static_cast<Eigen::Index>(all.size());
  Eigen::VectorXd residual(2 * count);
  Eigen::MatrixXd by_pose(2 * count, 6), noise = Eigen::MatrixXd::Zero(2 * count, 2 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    residual.segment<2>(2 * i) = all[i].residual_px;
    by_pose.middleRows<2>(2 * i) = all[i].by_pose;
    noise.block<2, 2>(2 * i, 2 * i) = all[i].covariance_px2;
  }
  return log_normal(residual + by_pose * before.mean,
                    by_pose * before.covariance * by_pose.transpose() + noise);
}

// ln of the terms of the header that do not depend on the places.
double log_of_counts(const PoseEvidence& pose, int missed) {
  const double seen = static_cast<double>(pose.lamps.size()), blobs = pose.blobs;
  const auto false_lights = [](double n) {
    double factorial = 1;
    for (int i = 2; i <= n; ++i) factorial *= i;
    return factorial / ((n + 1) * (n + 2));
  };
  // Mean of the probability of dark and lit lamps over the rate x with the density 2 (1 - x).
  constexpr int steps = 20000;
  double mean = 0;
  for (int i = 0; i < steps; ++i) {
    const double x = (i + 0.5) / steps;
    mean += 2 * (1 - x) * std::pow(x, missed) * std::pow(1 - x, seen) / steps;
  }
  return std::log(false_lights(blobs - seen) / false_lights(blobs) * mean) +
         seen * std::log(pose.image_px2);
}

PoseEvidence exact_camera(int lamps, double residual_px) {
  PoseEvidence pose = view_of(lamps, residual_px, 0.8);
  pose.model_sigma_px = 0;
  return pose;
}

TEST(Evidence, IsTheJointDensityOfThePlaces) {
  PoseEvidence pose = exact_camera(5, 1);
  pose.lamps[1].covariance_px2 << 0.5, 0.2, 0.2, 0.9;
  pose.blobs = 8;
  pose.missed = 2;
  pose.rotations = 0.3;
  pose.log_appearance = -1.7;
  const double expected =
      log_joint_places(pose, Poses(pose)) + log_of_counts(pose, 2) + pose.log_appearance;
  EXPECT_NEAR(evidence_of(pose), expected, 1e-4);
}

TEST(Evidence, OfCornersIsThatOfPointsSeenWithTheLamps) {
  PoseEvidence pose = exact_camera(4, 0.5);
  pose.corners = view_of(3, 0.7, 1.5).lamps;
  for (SeenLamp& corner : pose.corners) corner.by_pose.leftCols<3>() *= 0.2;
  const double expected = log_joint_places(pose, Poses(pose)) + log_of_counts(pose, 0);
  EXPECT_NEAR(evidence_of(pose), expected, 1e-4);
}

TEST(Evidence, ShapesLimitThePosesButDoNotCount) {
  PoseEvidence pose = exact_camera(4, 0.5);
  pose.lamps[2].shape_sigma_px = 0.6;
  pose.lamps[2].shape_residual_px = {0.4, -0.2, 0.1};
  pose.lamps[2].shape_by_pose << 0, 0, 0, 1, 2, 30, 5, 3, 0, 0, 0, 0, -2, 6, 0, 0, 0, 0;
  Poses before(pose);
  before.add(pose.lamps[2].shape_residual_px, pose.lamps[2].shape_by_pose,
             0.36 * Eigen::Matrix3d::Identity());
  const double expected = log_joint_places(pose, before) + log_of_counts(pose, 0);
  EXPECT_NEAR(evidence_of(pose), expected, 1e-4);
}

TEST(Evidence, IsTheMeanOverWrongPartsOfThePrior) {
  PoseEvidence pose = exact_camera(4, 0.5);
  pose.missed = 1;
  PriorPart height, turn;
  // Heights of -0.2 +- 0.1 m and rotations of 0.03 +- 0.02, relative to the pose.
  height.information(5, 5) = 100;
  height.gradient[5] = 20;
  height.chi2 = 4;
  height.wrong = 0.2;
  height.is_place = true;
  turn.information(2, 2) = 2500;
  turn.gradient[2] = -75;
  turn.chi2 = 2.25;
  turn.wrong = 0.1;
  pose.prior = {height, turn};
  const auto with = [&](bool by_height, bool by_turn) {
    Poses before(pose);
    const Eigen::RowVectorXd of_height = Vector6::Unit(5).transpose();
    const Eigen::RowVectorXd of_turn = Vector6::Unit(2).transpose();
    if (by_height)
      before.add(Eigen::VectorXd::Constant(1, 0.2), of_height,
                 Eigen::MatrixXd::Constant(1, 1, 0.01));
    if (by_turn)
      before.add(Eigen::VectorXd::Constant(1, -0.03), of_turn,
                 Eigen::MatrixXd::Constant(1, 1, 4e-4));
    return log_joint_places(pose, before);
  };
  const double counts = log_of_counts(pose, 1), elsewhere = log_of_counts(pose, 0);
  const double no_height = std::log(0.2) + with(false, true);
  const double no_turn = std::log(0.1) + with(true, false);
  const double right = std::log(0.8 * 0.9) + with(true, true);
  const internal::pose::LogEvidence found = internal::pose::log_evidence(pose);
  EXPECT_NEAR(found.value,
              counts + std::log(std::exp(no_height) + std::exp(no_turn) + std::exp(right)), 1e-3);
  EXPECT_NEAR(found.if_place_wrong, elsewhere + no_height, 1e-3);
  EXPECT_NEAR(found.if_prior_wrong, counts + no_turn, 1e-3);
  EXPECT_EQ(found.if_excluded(true), found.if_prior_wrong);
  EXPECT_EQ(found.if_excluded(false), std::max(found.if_prior_wrong, found.if_place_wrong));
}

TEST(Evidence, PosesOfOneAssignmentShareTheDensityBeforeTheirPlaces) {
  // The second pose misfits its shape by five sigmas, which counts as evidence against it.
  std::vector<PoseEvidence> group(2, exact_camera(4, 0.5));
  for (PoseEvidence& pose : group) pose.lamps[2].shape_sigma_px = 0.6;
  group[1].lamps[2].shape_residual_px = {3, 0, 0};
  const auto logs = internal::pose::log_evidences(group);
  EXPECT_NEAR(logs[0].value, evidence_of(group[0]), 1e-9);
  EXPECT_NEAR(logs[1].value, logs[0].value - 12.5, 1e-6);
  EXPECT_TRUE(internal::pose::log_evidences({}).empty());
}

TEST(Evidence, AllowsForErrorsOfCameraAndMap) {
  // Residuals of a typical error are no reason to doubt; the share of large errors limits the loss.
  const auto loss = [](double residual_px, double model_sigma_px) {
    PoseEvidence exact = view_of(6, 0, 0.02), off = view_of(6, residual_px, 0.02);
    exact.model_sigma_px = off.model_sigma_px = model_sigma_px;
    return evidence_of(exact) - evidence_of(off);
  };
  EXPECT_GT(loss(0.5, 0), 200);
  EXPECT_LT(loss(0.15, 0.5), loss(0.5, 0.5));
  EXPECT_LT(loss(0.5, 0.5), loss(2, 0.5));
  EXPECT_LT(loss(2, 0.5), 60);
}

}  // namespace
}  // namespace occ::test
