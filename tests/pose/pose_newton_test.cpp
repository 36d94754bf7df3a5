// SPDX-License-Identifier: Apache-2.0
// Misfit of a pose and its improvement by Newton's method; false alarms of a consensus.
#include "libocc/pose/internal/pose_newton.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/pose/internal/false_alarms.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::pose;
namespace {

/// Points before cameras at `origins` (none: one camera at zero), with exact bearings.
struct ExactView {
  Eigen::Matrix3Xd points, bearings, origins;
  Rigid3 pose;

  ExactView(std::uint64_t seed, int count, bool several) {
    Random random(31, seed);
    pose = {so3_exp(test::random_vector(random)), Eigen::Vector3d(0.2, -0.1, 5)};
    points.resize(3, count);
    bearings.resize(3, count);
    if (several) origins.resize(3, count);
    for (int i = 0; i < count; ++i) {
      points.col(i) = test::random_vector(random);
      Eigen::Vector3d from = Eigen::Vector3d::Zero();
      if (several) from = origins.col(i) = 0.3 * test::random_vector(random);
      bearings.col(i) = (pose * Eigen::Vector3d(points.col(i)) - from).normalized();
    }
  }
};

TEST(Misfit, IsTheLargestAngleToFirstOrder) {
  for (const bool several : {false, true}) {
    ExactView view(1, 5, several);
    EXPECT_LT(misfit_rad(view.bearings, view.points, view.origins, view.pose), 1e-14);
    Random random(32, 0);
    double largest = 0;
    for (int i = 0; i < 5; ++i) {
      const double angle = 1e-4 * (1 + random.below(9));
      const Eigen::Vector3d axis =
          Eigen::Vector3d(view.bearings.col(i)).cross(test::random_vector(random)).normalized();
      view.bearings.col(i) = so3_exp(angle * axis) * view.bearings.col(i);
      largest = std::max(largest, angle);
      EXPECT_NEAR(misfit_rad(view.bearings, view.points, view.origins, view.pose), largest,
                  1e-6 * largest);
    }
    view.bearings.col(3) *= -1;
    EXPECT_EQ(misfit_rad(view.bearings, view.points, view.origins, view.pose),
              std::numeric_limits<double>::infinity());
  }
}

TEST(PolishPose, ConvergesQuadraticallyToTheExactPose) {
  for (const bool several : {false, true})
    for (const int count : {3, 6})
      for (std::uint64_t seed = 0; seed < 10; ++seed) {
        const ExactView view(seed, count, several);
        Random random(33, seed);
        Rigid3 pose{so3_exp(1e-3 * test::random_vector(random)) * view.pose.rotation,
                    view.pose.translation + 1e-3 * test::random_vector(random)};
        double before = misfit_rad(view.bearings, view.points, view.origins, pose);
        EXPECT_GT(before, 1e-5);
        Rigid3 once = pose;
        polish_pose(view.bearings, view.points, view.origins, 1, once);
        const double after = misfit_rad(view.bearings, view.points, view.origins, once);
        EXPECT_LT(after, 0.05 * before);
        EXPECT_GT(after, 1e-12) << "one step leaves the square of the error";
        polish_pose(view.bearings, view.points, view.origins, 10, pose);
        EXPECT_LT(misfit_rad(view.bearings, view.points, view.origins, pose), 2e-15);
        EXPECT_LT((pose.translation - view.pose.translation).norm(), 1e-11);
      }
}

TEST(PolishPose, NeverWorsensAPose) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const ExactView view(seed, 5, false);
    Random random(34, seed);
    const Rigid3 start{so3_exp(0.7 * test::random_vector(random)) * view.pose.rotation,
                       view.pose.translation + test::random_vector(random)};
    const double before = misfit_rad(view.bearings, view.points, view.origins, start);
    Rigid3 pose = start;
    for (int steps = 1; steps < 6; ++steps) {
      polish_pose(view.bearings, view.points, view.origins, 1, pose);
      const double after = misfit_rad(view.bearings, view.points, view.origins, pose);
      EXPECT_LE(after, before) << seed;
    }
  }
}

double choose(int n, int k) { return k == 0 ? 1 : choose(n - 1, k - 1) * n / k; }

double nfa(const FalseAlarmModel& c, int k) {
  return (c.points - c.sample) * c.poses * choose(c.points, k) * choose(k, c.sample) *
         std::pow(c.probability, k - c.sample);
}

TEST(FalseAlarms, AreThoseOfTheFormula) {
  const FalseAlarmModel model{12, 3, 4, 0.01};
  for (int k = 4; k <= 12; ++k)
    EXPECT_NEAR(log_false_alarms(model, k), std::log(nfa(model, k)), 1e-9) << k;
  EXPECT_EQ(log_false_alarms(model, 3), std::numeric_limits<double>::infinity());
}

TEST(FalseAlarms, TheSmallestNumberOfInliersIsTheFirstBelowTheLimit) {
  for (const int points : {4, 7, 20, 60})
    for (const int sample : {2, 3})
      for (const double probability : {1e-4, 0.02, 0.3})
        for (const double limit : {1.0, 1e-3, 1e-9}) {
          const FalseAlarmModel model{points, sample, 4, probability};
          int expected = points + 1;
          for (int k = points; k > sample; --k)
            if (nfa(model, k) <= limit) expected = k;
          EXPECT_EQ(min_inliers(model, limit), expected)
              << points << " " << sample << " " << probability << " " << limit;
        }
  EXPECT_EQ(min_inliers({3, 3, 4, 1e-9}, 1), 4);
  EXPECT_EQ(min_inliers({2, 3, 4, 1e-9}, 1), 3);
}

}  // namespace
}  // namespace occ
