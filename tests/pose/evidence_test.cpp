// SPDX-License-Identifier: Apache-2.0
// Evidence for a pose: its integral, what raises and lowers it, and probabilities.
#include "libocc/pose/internal/evidence.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace occ::test
