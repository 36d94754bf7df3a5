// SPDX-License-Identifier: Apache-2.0
// Condition number of a pose: growth of the bearings' errors into errors of the pose.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/pose/candidates.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

TEST(PoseCondition, ThrowsForInvalidArguments) {
  Random random(29);
  const KnownProblem known = random_problem(random, 4, {});
  PoseProblem p = known.problem;
  p.bearings.conservativeResize(3, 3);
  EXPECT_NE(complaint([&] { pose_condition(p, known.truth); }).find("bearings"), std::string::npos);
  p = known.problem;
  p.points(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(complaint([&] { pose_condition(p, known.truth); }).find("points[1]"),
            std::string::npos);
}

// Largest singular value of d(rotation, position / distance) / d bearings by central differences of
// the solution.
double condition_by_differences(const PoseProblem& p, const Rigid3& pose) {
  constexpr double step = 1e-7;
  const auto solved = [&](const PoseProblem& moved) {
    Rigid3 nearest;
    double smallest = std::numeric_limits<double>::infinity();
    for (const Rigid3& c : p3p(Eigen::Matrix3d(moved.bearings), Eigen::Matrix3d(moved.points)))
      if (pose_error(c, pose) < smallest) smallest = pose_error(nearest = c, pose);
    Vector6 pose_vector;
    pose_vector << so3_log(nearest.rotation * pose.rotation.transpose()),
        nearest.origin_in_source() / pose.translation.norm();
    return pose_vector;
  };
  Matrix6 by_bearings;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d f = p.bearings.col(i), u = f.unitOrthogonal(), v = f.cross(u);
    for (int k = 0; k < 2; ++k) {
      PoseProblem above = p, below = p;
      above.bearings.col(i) = (f + step * (k ? v : u)).normalized();
      below.bearings.col(i) = (f - step * (k ? v : u)).normalized();
      by_bearings.col(2 * i + k) = (solved(above) - solved(below)) / (2 * step);
    }
  }
  return by_bearings.jacobiSvd().singularValues()[0];
}

TEST(PoseCondition, AgreesWithCentralDifferences) {
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    Random random(32, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, 3, {});
    const double condition = pose_condition(known.problem, known.truth);
    if (condition > 100) continue;
    ++compared;
    EXPECT_NEAR(condition_by_differences(known.problem, known.truth) / condition, 1, 1e-3) << i;
  }
  EXPECT_GT(compared, 100);
}

TEST(PoseCondition, DoesNotDependOnTheWorld) {
  for (int i = 0; i < 50; ++i) {
    Random random(30, static_cast<std::uint64_t>(i));
    const KnownProblem known = random_problem(random, 3 + i % 5, {i % 2 == 1, i % 3 == 0, false});
    const double condition = pose_condition(known.problem, known.truth);
    const Rigid3 world_from_old = random_pose(random);
    const double unit = std::pow(10, random.uniform(-3, 3));
    PoseProblem moved = known.problem;
    moved.origins *= unit;
    for (int k = 0; k < moved.size(); ++k)
      moved.points.col(k) = unit * (world_from_old * Eigen::Vector3d(moved.points.col(k)));
    Rigid3 pose = known.truth * world_from_old.inverse();
    pose.translation *= unit;
    EXPECT_NEAR(pose_condition(moved, pose) / condition, 1, 1e-9) << i;
  }
}

TEST(PoseCondition, IsHugeAtADoubleRoot) {
  PoseProblem p;
  p.points = (Eigen::Matrix3Xd(3, 3) << 1, -0.5, -0.2, 0, 0.8, -0.9, 0, 0, 0).finished();
  for (const double height : {1.0, 2.5, 6.0}) {  // below the first point, which is on the cylinder
    const Rigid3 pose{Eigen::Matrix3d::Identity(), {-1, 0, height}};
    p.bearings = (p.points.colwise() + pose.translation).colwise().normalized();
    EXPECT_GT(pose_condition(p, pose), 1e6);
    const Rigid3 beside{pose.rotation, pose.translation + Eigen::Vector3d(0.3, 0, 0)};
    p.bearings = (p.points.colwise() + beside.translation).colwise().normalized();
    EXPECT_LT(pose_condition(p, beside), 1e3);
  }
  p.points.conservativeResize(3, 2);
  p.bearings.conservativeResize(3, 2);
  EXPECT_GT(pose_condition(p, {Eigen::Matrix3d::Identity(), {-1, 0, 2}}), 1e6);  // two points
}

}  // namespace
}  // namespace occ::test
