// SPDX-License-Identifier: Apache-2.0
// Precise images far from an uncertain prediction, as at the start with unknown velocity.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "libocc/geometry/motion.hpp"
#include "libocc/track/pose_filter.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Vector6 far() {
  Vector6 out;
  out << 0.2, -0.25, 0.3, 0.3, 0.2, -0.4;
  return out;
}

TEST(PoseFilterFar, APreciseImageIsBelievedWhereverItIs) {
  const Rigid3 start = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
  const Rigid3 truth = perturb(start, far());
  PoseFilter filter;
  filter.start(0, start, 0.25 * Matrix6::Identity());
  const Matrix6 covariance = 1e-10 * Matrix6::Identity();
  ASSERT_TRUE(filter.add(PoseObservation::of_pose(1e-3, truth, covariance)).accepted());
  const Vector6 off = difference(filter.at(1e-3)->body_from_world, truth);
  EXPECT_LT(off.norm(), 1e-8);
  const Matrix6 found = filter.at(1e-3)->covariance;
  EXPECT_LT((found - covariance).norm(), 1e-3 * covariance.norm());
}

TEST(PoseFilterFar, AnImageThatSaysNothingLeavesThePrediction) {
  const Rigid3 start = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
  Random random(1);
  Matrix6 root;
  for (int i = 0; i < 6; ++i)
    root.row(i) << test::random_vector(random).transpose(), test::random_vector(random).transpose();
  const Matrix6 covariance = 1e-2 * root * root.transpose() + 1e-4 * Matrix6::Identity();
  PoseFilter filter;
  filter.start(0, start, covariance);
  PoseObservation nothing;
  nothing.time_s = 0;
  nothing.cam_from_world = perturb(start, far());
  ASSERT_TRUE(filter.add(nothing).accepted());
  EXPECT_LT(difference(filter.at(0)->body_from_world, start).norm(), 1e-12);
  EXPECT_LT((filter.at(0)->covariance - covariance).norm(), 1e-9 * covariance.norm());
}

TEST(PoseFilterFar, TheSecondImageOfAMovingBodyIsConsistent) {
  // The body accelerates unexpectedly: a step of 0.1 m and 0.06 rad for the filter.
  double sum = 0;
  constexpr int runs = 200;
  for (std::uint64_t run = 0; run < runs; ++run) {
    Random random(run);
    const Rigid3 begin = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});
    Vector6 velocity;
    velocity << test::random_vector(random), test::random_vector(random);
    const Rigid3 end = moved_pose(begin, velocity, 0.1);
    const double sigma = 1e-4;
    const auto seen = [&](const Rigid3& pose, double time_s) {
      Vector6 noise;
      noise << test::random_vector(random), test::random_vector(random);
      return PoseObservation::of_pose(time_s, perturb(pose, sigma * noise),
                                      sigma * sigma * Matrix6::Identity());
    };
    PoseFilter filter;
    filter.start(0, begin, 1e-2 * Matrix6::Identity());
    filter.add(seen(begin, 0));
    filter.add(seen(end, 0.1));
    const Vector6 off = difference(end, filter.at(0.1)->body_from_world);
    sum += test::nees(off, filter.at(0.1)->covariance);
  }
  EXPECT_NEAR(sum / (6 * runs), 1, 3 * std::sqrt(2.0 / (6 * runs)));
}

}  // namespace
}  // namespace occ
