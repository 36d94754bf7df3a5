// SPDX-License-Identifier: Apache-2.0
// Relative orientation: the truth among the results for points in space and in a plane, with noise
// and with gross errors; nothing where images do not determine it.
#include "libocc/pose/relative_orientation.hpp"

#include <gtest/gtest.h>

#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

struct TwoImages {
  Rigid3 second_from_first;
  Matrix3Xd first, second;  // bearings
};

/// `count` points 3 m from the first image, in a plane if `depth` is 0, with errors of `sigma_rad`.
TwoImages two_images(Random& random, int count, double depth, double sigma_rad = 0) {
  const auto vector = [&](double x, double y, double z) {
    return Vector3d(random.uniform(-x, x), random.uniform(-y, y), random.uniform(-z, z));
  };
  TwoImages images;
  images.second_from_first.rotation = so3_exp(vector(0.3, 0.3, 1));
  images.second_from_first.translation = vector(1, 1, 0.3).normalized();
  images.first.resize(3, count);
  images.second.resize(3, count);
  for (int i = 0; i < count; ++i) {
    const Vector3d point = Vector3d(0, 0, 3) + vector(2, 2, depth);
    images.first.col(i) = (point.normalized() + sigma_rad * vector(1.7, 1.7, 1.7)).normalized();
    images.second.col(i) =
        ((images.second_from_first * point).normalized() + sigma_rad * vector(1.7, 1.7, 1.7))
            .normalized();
  }
  return images;
}

double error(const Rigid3& a, const Rigid3& b) {
  return (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm();
}

double best_error(const std::vector<RelativePose>& found, const Rigid3& truth) {
  double best = 10;
  for (const RelativePose& pose : found)
    best = std::min(best, error(pose.second_from_first, truth));
  return best;
}

TEST(RelativeOrientation, FivePairsHaveTheTrueEssentialMatrix) {
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(1, i);
    const TwoImages images = two_images(random, 5, i % 2 == 0 ? 1 : 0);
    const Eigen::Matrix3d truth = skew(images.second_from_first.translation) *
                                  images.second_from_first.rotation / std::sqrt(2.0);
    double best = 10;
    for (const Eigen::Matrix3d& found : essential_matrices(images.first, images.second)) {
      EXPECT_NEAR(found.determinant(), 0, 1e-7);
      for (int k = 0; k < 5; ++k)
        EXPECT_NEAR(images.second.col(k).dot(found * images.first.col(k)), 0, 1e-10);
      best = std::min({best, (found - truth).norm(), (found + truth).norm()});
    }
    EXPECT_LT(best, 1e-5) << i;
  }
}

TEST(RelativeOrientation, HoldsTheTruthInSpaceAndInAPlane) {
  for (std::uint64_t i = 0; i < 40; ++i) {
    Random random(2, i);
    const TwoImages images = two_images(random, 6 + static_cast<int>(i % 9), i % 2 == 0 ? 1 : 0);
    const auto found = relative_orientation(images.first, images.second);
    EXPECT_LT(best_error(found, images.second_from_first), 1e-4) << i;
    EXPECT_LE(found.size(), 4u);
  }
}

TEST(RelativeOrientation, BearsNoiseAndAThirdOfGrossErrors) {
  int near = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(3, i);
    TwoImages images = two_images(random, 18, 1, 1e-4);
    for (int k = 0; k < 6; ++k)
      images.second.col(k) =
          Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 1.5).normalized();
    const auto found = relative_orientation(images.first, images.second);
    ASSERT_FALSE(found.empty());
    EXPECT_LT(found[0].error_rad, 2e-3);
    near += best_error(found, images.second_from_first) < 0.05 ? 1 : 0;
  }
  EXPECT_GE(near, 19);
}

TEST(RelativeOrientation, CountsPointsWithABaseline) {
  Random random(4);
  TwoImages images = two_images(random, 8, 1);
  EXPECT_EQ(relative_orientation(images.first, images.second)[0].intersected, 8);
  for (int i = 0; i < 8; ++i)  // turned only
    images.second.col(i) = images.second_from_first.rotation * images.first.col(i);
  for (const RelativePose& pose : relative_orientation(images.first, images.second))
    EXPECT_LT(pose.intersected, 6);
}

TEST(RelativeOrientation, NeedsFourPairsOfOneCount) {
  Random random(5);
  const TwoImages images = two_images(random, 5, 1);
  EXPECT_TRUE(relative_orientation(images.first.leftCols(3), images.second.leftCols(3)).empty());
  EXPECT_THROW(relative_orientation(images.first, images.second.leftCols(4)),
               std::invalid_argument);
  EXPECT_THROW(planar_orientations(images.first, images.second.leftCols(4)), std::invalid_argument);
  EXPECT_THROW(planar_orientations(images.first.leftCols(3), images.second.leftCols(3)),
               std::invalid_argument);
  EXPECT_THROW(essential_matrices(images.first, images.second.leftCols(4)), std::invalid_argument);
}

TEST(RelativeOrientation, FourAndFivePointsOfAPlaneHaveTheTruthAmongTheirPoses) {
  for (std::uint64_t i = 0; i < 60; ++i) {
    Random random(6, i);
    const int count = 4 + static_cast<int>(i % 2);
    const TwoImages images = two_images(random, count, 0);
    const auto planar = planar_orientations(images.first, images.second);
    EXPECT_LE(planar.size(), 2u);
    EXPECT_LT(best_error(planar, images.second_from_first), 1e-6) << i;
    const auto found = relative_orientation(images.first, images.second);
    EXPECT_LT(best_error(found, images.second_from_first), 1e-6) << i;
    for (const RelativePose& pose : planar) EXPECT_GT(pose.angle_rad, 0);
  }
  Random random(7);
  const TwoImages in_space = two_images(random, 5, 1);
  EXPECT_LT(
      best_error(relative_orientation(in_space.first, in_space.second), in_space.second_from_first),
      1e-5);
}

TEST(RelativeOrientation, APlaneSeenFromOnePlaceHasNone) {
  Random random(8);
  TwoImages images = two_images(random, 6, 0);
  images.second = images.second_from_first.rotation * images.first;
  EXPECT_TRUE(planar_orientations(images.first, images.second).empty());
  const Matrix3Xd same = Vector3d(0, 0, 1).replicate(1, 4);
  EXPECT_TRUE(planar_orientations(same, same).empty());
}

TEST(RelativeOrientation, EqualBearingsGiveNoNan) {
  const Matrix3Xd same = Vector3d(0, 0, 1).replicate(1, 8);
  for (const RelativePose& pose : relative_orientation(same, same)) {
    EXPECT_TRUE(pose.second_from_first.rotation.allFinite());
    EXPECT_EQ(pose.intersected, 0);
  }
}

}  // namespace
}  // namespace occ
