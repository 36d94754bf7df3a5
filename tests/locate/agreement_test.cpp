// SPDX-License-Identifier: Apache-2.0
// Significance of the inliers of a pose, and probabilities of rival poses.
#include "libocc/locate/internal/agreement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/internal/map_rivals.hpp"
#include "libocc/locate/robust_pose.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::locate;
using internal::pose::FalseAlarmModel;
using internal::pose::log_false_alarms;
namespace {

/// 100 pixels on a grid of 60 px, without neighbours.
Eigen::Matrix2Xd grid_of_pixels() {
  Eigen::Matrix2Xd pixels(2, 100);
  for (int i = 0; i < 100; ++i) pixels.col(i) << 60 * (i % 10), 60 * (i / 10);
  return pixels;
}
constexpr double grid_area = 540.0 * 540.0;

std::vector<Agreement> with_residuals(int count, double residual_px, int first = 0) {
  std::vector<Agreement> inliers;
  for (int i = 0; i < count; ++i) inliers.push_back({first + i, residual_px});
  return inliers;
}

/// Expected number of false alarms with this radius.
double alarms_in(double radius_px, int inliers, int points = 100) {
  return log_false_alarms({points, 3, 4, pi * radius_px * radius_px / grid_area}, inliers);
}

TEST(Significance, ChanceIsTheShareOfTheArea) {
  Eigen::Matrix2Xd pixels(2, 3);
  pixels << 0, 200, 50, 10, 110, 20;
  const FalseAlarmModel chance = chance_anywhere(pixels, 5, 3, 4);
  EXPECT_NEAR(chance.probability, pi * 25 / (200.0 * 100.0), 1e-12);
  EXPECT_EQ(chance.points, 3);
  EXPECT_EQ(chance.sample, 3);
  EXPECT_EQ(chance.poses, 4);
  // A row of pixels has the height of the radius.
  pixels.row(1).setConstant(4);
  EXPECT_NEAR(chance_anywhere(pixels, 5, 3, 4).probability, pi * 25 / (200.0 * 10.0), 1e-12);
}

TEST(Significance, HasTheRadiusOfTheResiduals) {
  const Eigen::Matrix2Xd pixels = grid_of_pixels();
  // Residuals below sigma count as sigma.
  Significance found = significance(pixels, with_residuals(9, 0.2), 1, 3, 4);
  EXPECT_NEAR(found.radius_px, 1, 1e-12);
  EXPECT_NEAR(found.log_false_alarms, alarms_in(1, 9), 1e-9);
  // Others are scaled up: 9 points leave 12 of 18 degrees of freedom.
  found = significance(pixels, with_residuals(9, 3), 1, 3, 4);
  EXPECT_NEAR(found.radius_px, 3 * std::sqrt(18.0 / 12), 1e-12);
  EXPECT_NEAR(found.log_false_alarms, alarms_in(3 * std::sqrt(1.5), 9), 1e-9);
}

TEST(Significance, IsThatOfTheBestRadius) {
  const Eigen::Matrix2Xd pixels = grid_of_pixels();
  // Eight exact inliers and two poor ones: the eight alone are more significant.
  std::vector<Agreement> inliers = with_residuals(8, 0.5);
  const std::vector<Agreement> poor = with_residuals(2, 20, 8);
  inliers.insert(inliers.begin(), poor.begin(), poor.end());
  const Significance found = significance(pixels, inliers, 1, 3, 4);
  EXPECT_NEAR(found.log_false_alarms, alarms_in(1, 8), 1e-9);
  EXPECT_NEAR(found.radius_px, 20 * std::sqrt(10.0 / 7), 1e-9);
  // Two exact ones among eight poor ones are no pose.
  inliers = with_residuals(8, 20);
  inliers[0].residual_px = inliers[1].residual_px = 0.5;
  EXPECT_NEAR(significance(pixels, inliers, 1, 3, 4).log_false_alarms,
              alarms_in(20 * std::sqrt(8.0 / 5), 8), 1e-9);
  EXPECT_EQ(significance(pixels, with_residuals(3, 0.1), 1, 3, 4).log_false_alarms,
            std::numeric_limits<double>::infinity());
}

TEST(Significance, CountsInliersThatShareARadiusOnce) {
  // Each pixel has a neighbour at 0.3 px: 12 inliers are as good as 6 of 50.
  Eigen::Matrix2Xd pixels = grid_of_pixels();
  for (int i = 0; i < 50; ++i) pixels.col(99 - i) = pixels.col(i) + Eigen::Vector2d(0.3, 0);
  std::vector<Agreement> inliers = with_residuals(6, 0.2);
  for (int i = 0; i < 6; ++i) inliers.push_back({99 - i, 0.2});
  const Eigen::Vector2d size = pixels.rowwise().maxCoeff() - pixels.rowwise().minCoeff();
  // A random point is within the radius of another one with the probability 1 / 99 at least.
  const double probability = std::max(pi / size.prod(), 1.0 / 99);
  EXPECT_NEAR(significance(pixels, inliers, 1, 3, 4).log_false_alarms,
              log_false_alarms({50, 3, 4, probability}, 6), 1e-9);
}

TEST(Significance, IsReportedAsADecimalLogarithm) {
  const Camera camera = test::vga_camera();
  const Rigid3 pose{so3_exp({0.1, -0.2, 0.3}), {0.1, -0.2, 6}};
  Random random(96, 0);
  Eigen::Matrix3Xd points(3, 30);
  Eigen::Matrix2Xd pixels(2, 30);
  std::vector<Agreement> inliers;
  for (int i = 0; i < 30; ++i) {
    points.col(i) = test::random_vector(random);
    pixels.col(i) = *camera.project(pose * Eigen::Vector3d(points.col(i)));
    if (i < 18)
      inliers.push_back({i, 0});
    else
      pixels.col(i) << random.uniform(0, 639), random.uniform(0, 479);
  }
  RobustPoseOptions options;
  const Result<RobustPose> found = robust_pose(points, pixels, camera, options);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(std::count(found->inliers.begin(), found->inliers.end(), true), 18);
  const double expected = significance(pixels, inliers, options.sigma_px, 3, 4).log_false_alarms;
  EXPECT_LT(expected, -20);
  EXPECT_NEAR(found->log10_false_alarms, expected / 2.302585092994046, 1e-3);
}

TEST(RestsOnALine, UnlessTheOthersAreSignificant) {
  const FalseAlarmModel chance{30, 3, 4, 1e-3};
  Random random(95, 0);
  const auto rests = [&](int on_line, int beside) {
    Eigen::Matrix3Xd points(3, on_line + beside);
    std::vector<int> inliers;
    for (int i = 0; i < points.cols(); ++i) {
      points.col(i) = (-1.0 + 0.2 * i) * Eigen::Vector3d(1, 0.4, 0.1);
      if (i >= on_line) points.col(i) += test::random_vector(random);
      inliers.push_back(i);
    }
    return rests_on_a_line(points, inliers, 1000, chance, 1e-3);
  };
  EXPECT_TRUE(rests(8, 0));
  for (int trial = 0; trial < 20; ++trial) EXPECT_TRUE(rests(8, 1)) << trial;
  // A random rotation about the line of eight of 30 points has three more inliers by chance 0.3
  // times, 42 C(22, 3) 3 p^2, but five more only 5e-6 times, 42 C(22, 5) 5 p^4.
  EXPECT_TRUE(rests(8, 2));
  EXPECT_TRUE(rests(8, 3));
  EXPECT_FALSE(rests(8, 5));
  EXPECT_FALSE(rests(0, 8));
}

TEST(RestsOnALine, WithinTheNoiseOfTheirHeight) {
  const FalseAlarmModel chance{30, 3, 4, 1e-3};
  Eigen::Matrix3Xd points(3, 8);
  std::vector<int> inliers;
  for (int i = 0; i < 8; ++i) {
    points.col(i) << -1.0 + 0.3 * i, (i % 2 == 0 ? 0.01 : -0.01), 0;
    inliers.push_back(i);
  }
  // The root of the sum of squared heights is 0.028; four sigmas of 1 / 100 are needed.
  EXPECT_TRUE(rests_on_a_line(points, inliers, 100, chance, 1e-3));
  EXPECT_FALSE(rests_on_a_line(points, inliers, 1000, chance, 1e-3));
}

Candidate candidate(double chi2) {
  Candidate out;
  out.chi2 = chi2;
  return out;
}

TEST(BestCandidate, ProbabilitiesAreThoseOfTheLikelihoods) {
  Fix fix;
  fix.candidates = {candidate(3), candidate(5), candidate(9)};
  weigh(fix, 2);
  const double second = std::exp(-0.5), third = std::exp(-1.5), sum = 1 + second + third;
  EXPECT_NEAR(*fix.candidates[0].probability, 1 / sum, 1e-12);
  EXPECT_NEAR(*fix.candidates[1].probability, second / sum, 1e-12);
  EXPECT_NEAR(*fix.candidates[2].probability, third / sum, 1e-12);
  EXPECT_NEAR(*fix.risk, (second + third) / sum, 1e-12);
  weigh(fix, 2, 0.25);  // poses that are no candidates
  EXPECT_NEAR(*fix.candidates[0].probability, 1 / (sum + 0.25), 1e-12);
  EXPECT_NEAR(*fix.risk, (second + third + 0.25) / (sum + 0.25), 1e-12);
  EXPECT_EQ(rivals_message(fix), "3 poses fit; the best is right with a probability of 0.48");
  fix.candidates[0].probability.reset();
  EXPECT_EQ(rivals_message(fix), "3 poses fit");
}

TEST(BestCandidate, IsCopiedToTheFix) {
  Fix fix;
  Candidate best = candidate(1);
  best.cam_from_world = {so3_exp({0.2, 0.3, -0.1}), {1, 2, 3}};
  best.covariance.setIdentity();
  best.position_m = best.cam_from_world.origin_in_source();
  best.rms_px = 0.7;
  best.lamps[4].flux_dn = 12;
  fix.candidates = {best, candidate(2)};
  take_best(fix);
  EXPECT_EQ(fix.cam_from_world.translation, best.cam_from_world.translation);
  EXPECT_EQ(fix.position_m, best.position_m);
  EXPECT_EQ(fix.covariance, best.covariance);
  EXPECT_EQ(fix.position_covariance_m2, position_covariance(best.cam_from_world, best.covariance));
  EXPECT_EQ(fix.rms_px, 0.7);
  EXPECT_EQ(fix.lamps.at(4).flux_dn, 12);
}

TEST(MapRivals, JoinTheRefinementBySharesOfOne) {
  internal::refine::Refinement refinement;
  refinement.poses.resize(2);
  refinement.poses[0].probability = 0.6;
  refinement.poses[1].probability = 0.3;
  refinement.none = 0.1;
  std::vector<internal::refine::RankedPose> rivals(2);
  rivals[0].probability = 0.2;
  rivals[1].probability = 0.8;
  append_rivals(std::move(rivals), refinement);
  std::vector<double> shares;
  for (const auto& pose : refinement.poses) shares.push_back(pose.probability);
  ASSERT_EQ(shares.size(), 4u);
  EXPECT_NEAR(shares[0], 0.4, 1e-12);
  EXPECT_NEAR(shares[1], 0.3, 1e-12);
  EXPECT_NEAR(shares[2], 0.15, 1e-12);
  EXPECT_NEAR(shares[3], 0.1, 1e-12);
  EXPECT_NEAR(refinement.none, 0.05, 1e-12);
}

}  // namespace
}  // namespace occ
