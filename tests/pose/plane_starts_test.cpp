// SPDX-License-Identifier: Apache-2.0
// Initial poses of a plane: the truth without noise, and both poses of a distant plane.
#include "libocc/pose/internal/plane_starts.hpp"

#include <gtest/gtest.h>

#include "tests/support/solver_problems.hpp"

namespace occ::test {
namespace {

using internal::pose::plane_starts;
using internal::pose::reflected_pose;

double misfit(const PoseProblem& problem, const Rigid3& pose) {
  const Eigen::Matrix3Xd seen =
      ((pose.rotation * problem.points).colwise() + pose.translation).colwise().normalized();
  return (seen - problem.bearings).norm();
}

TEST(PlaneStarts, HoldTheTruth) {
  for (int i = 0; i < 50; ++i) {
    Random random(61, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, 4 + i % 5, {true, false, false});
    EXPECT_LT(best_error(plane_starts(known.problem), known.truth), 1e-6) << i;
  }
}

TEST(PlaneStarts, HoldBothPosesOfADistantPlane) {
  for (int i = 0; i < 50; ++i) {
    Random random(62, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, 4, {true, false, false, 1000, 1001});
    const std::vector<Rigid3> starts = plane_starts(known.problem);
    ASSERT_EQ(starts.size(), 2u) << i;
    for (const Rigid3& start : starts) EXPECT_LT(misfit(known.problem, start), 1e-5) << i;
  }
}

TEST(PlaneStarts, ReflectionIsARotationThatFitsAndIsItsOwnInverse) {
  for (int i = 0; i < 50; ++i) {
    Random random(63, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, 5, {true, false, false, 1000, 1001});
    const Rigid3 other = reflected_pose(known.problem, known.truth);
    EXPECT_LT((other.rotation.transpose() * other.rotation - Eigen::Matrix3d::Identity()).norm(),
              1e-12);
    EXPECT_GT(other.rotation.determinant(), 0);
    EXPECT_LT(misfit(known.problem, other), 1e-5) << i;
    EXPECT_LT(pose_error(reflected_pose(known.problem, other), known.truth), 1e-9) << i;
  }
}

TEST(PlaneStarts, EmptyForPointsOnALine) {
  PoseProblem problem;
  problem.points = Eigen::Vector3d::UnitX() * Eigen::RowVector4d(-1, 0, 1, 2);
  problem.bearings = (problem.points.colwise() + Eigen::Vector3d(0, 0, 3)).colwise().normalized();
  EXPECT_TRUE(plane_starts(problem).empty());
}

}  // namespace
}  // namespace occ::test
