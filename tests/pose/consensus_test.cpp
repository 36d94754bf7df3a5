// SPDX-License-Identifier: Apache-2.0
// Search for the pose with the most inliers: number of samples, inliers, cost.
#include "libocc/pose/internal/consensus.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/pose/internal/bearing_basis.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::pose;
namespace {

constexpr double sigma_rad = 1e-3;

/// Points seen with small noise; the last ones have random bearings.
struct MixedPoints {
  Eigen::Matrix3Xd points, bearings;
  Rigid3 pose{so3_exp({0.3, -0.2, 0.5}), {0.1, -0.2, 4}};
  ConsensusOptions options;

  MixedPoints(int count, int outliers, std::uint64_t seed = 0, double noise_rad = 1e-4) {
    Random random(61, seed);
    points.resize(3, count);
    bearings.resize(3, count);
    for (int i = 0; i < count; ++i) {
      points.col(i) = test::random_vector(random);
      const Eigen::Vector3d direction = (pose * Eigen::Vector3d(points.col(i))).normalized();
      bearings.col(i) = turned(direction, noise_rad * random.normal(), random);
      if (i >= count - outliers)
        bearings.col(i) =
            Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 1).normalized();
    }
  }
  static Eigen::Vector3d turned(const Eigen::Vector3d& bearing, double angle, Random& random) {
    return so3_exp(angle * bearing.cross(test::random_vector(random)).normalized()) * bearing;
  }
  SeenPoints seen() const {
    SeenPoints out;
    for (int i = 0; i < points.cols(); ++i)
      out.add(points.col(i), bearings.col(i), tangent_basis(bearings.col(i)) / sigma_rad,
              Eigen::Vector3d::Zero());
    return out;
  }
  Consensus found() const { return find_consensus(points, bearings, seen(), options); }
  /// Angle between bearing and point in sigmas.
  double sigmas(int i, const Rigid3& at) const {
    const Eigen::Vector3d x = at * Eigen::Vector3d(points.col(i));
    return bearings.col(i).cross(x).norm() / bearings.col(i).dot(x) / sigma_rad;
  }
};

TEST(Consensus, FindsAllInliersAndTheirPose) {
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    for (const bool upright : {false, true}) {
      MixedPoints mixed(20, 9, seed);
      mixed.options.seed = seed;
      if (upright) mixed.options.up_in_cam = mixed.pose.rotation.col(2);
      const Consensus found = mixed.found();
      ASSERT_EQ(found.inliers.size(), 11u) << seed;
      for (int i = 0; i < 11; ++i) EXPECT_EQ(found.inliers[static_cast<std::size_t>(i)], i);
      EXPECT_LT((found.pose.translation - mixed.pose.translation).norm(), 2e-3);
      EXPECT_TRUE(found.confident);
      double cost = 9;
      for (int i = 0; i < 11; ++i) cost += std::pow(mixed.sigmas(i, found.pose) / 4, 2);
      EXPECT_NEAR(found.cost, cost, 1e-3);
    }
}

double draws(int inliers, int count, int sample, double confidence = 0.9999) {
  double clean = 1;
  for (int i = 0; i < sample; ++i) clean *= static_cast<double>(inliers - i) / (count - i);
  return std::ceil(std::log(1 - confidence) / std::log(1 - clean));
}

TEST(Consensus, DrawsUntilASampleIsCleanWithTheConfidence) {
  // Random bearings: no pose has ten inliers.
  for (const bool upright : {false, true}) {
    MixedPoints none(20, 20);
    none.options.min_inliers = 10;
    if (upright) none.options.up_in_cam = Eigen::Vector3d(0, -1, 0);
    EXPECT_EQ(none.found().iterations, draws(10, 20, upright ? 2 : 3));
    EXPECT_TRUE(none.found().confident);
    none.options.max_iterations = 20;
    EXPECT_EQ(none.found().iterations, 20);
    EXPECT_FALSE(none.found().confident);
    none.options.max_iterations = 100000;
    none.options.confidence = 0.99;
    EXPECT_EQ(none.found().iterations, draws(10, 20, upright ? 2 : 3, 0.99));
  }
}

TEST(Consensus, StopsEarlierOnceAPoseHasMoreInliers) {
  MixedPoints mixed(20, 5);
  mixed.options.min_inliers = 5;
  const Consensus found = mixed.found();
  EXPECT_EQ(found.inliers.size(), 15u);
  EXPECT_LE(found.iterations, draws(15, 20, 3));
  EXPECT_GT(draws(5, 20, 3), 50 * draws(15, 20, 3));
  const Consensus all = MixedPoints(20, 0).found();
  EXPECT_EQ(all.inliers.size(), 20u);
  EXPECT_EQ(all.iterations, 1);
  EXPECT_TRUE(all.confident);
}

TEST(Consensus, CountsPointsInsideTheGate) {
  for (const double off_sigmas : {3.0, 5.0}) {
    MixedPoints mixed(24, 0, 3, 0);
    Random random(62, 0);
    mixed.bearings.col(7) =
        MixedPoints::turned(mixed.bearings.col(7), off_sigmas * sigma_rad, random);
    const Consensus found = mixed.found();
    const bool is_in =
        std::find(found.inliers.begin(), found.inliers.end(), 7) != found.inliers.end();
    EXPECT_EQ(is_in, off_sigmas < 4);
    EXPECT_EQ(found.inliers.size(), is_in ? 24u : 23u);
  }
}

TEST(Consensus, IsTheSameForTheSameSeed) {
  MixedPoints mixed(20, 9, 5);
  const Consensus first = mixed.found(), second = mixed.found();
  EXPECT_EQ(first.pose.translation, second.pose.translation);
  EXPECT_EQ(first.iterations, second.iterations);
}

TEST(Consensus, OfPointsOnALineHasNoPose) {
  MixedPoints mixed(4, 0);
  for (int i = 0; i < 4; ++i) mixed.points.col(i) = Eigen::Vector3d(i, 0.5 * i, 1 - 0.2 * i);
  mixed.options.max_iterations = 30;
  EXPECT_TRUE(mixed.found().inliers.empty());
  EXPECT_EQ(mixed.found().cost, 4);
}

}  // namespace
}  // namespace occ
