// SPDX-License-Identifier: Apache-2.0
// Lamps on a line: rows, rotations about their line, and its unit height.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::identify;
namespace {

/// Three lamps on a line and one beside it, and a pose.
struct Row {
  IdentifyOptions options;
  AssignmentProblem problem;
  Rigid3 pose{so3_exp({0.3, -0.2, 0.5}), {0.1, -0.2, 4}};
  Eigen::Vector3d along = Eigen::Vector3d(1, 0.5, -0.2).normalized();
  Assignment assignment{Pair{0, 0}, Pair{1, 1}, Pair{2, 2}};

  Row() {
    problem.options = &options;
    problem.origin = {5, 6, 7};
    for (const double at : {-1.0, 0.2, 1.0}) add(at * along);
  }
  void add(const Eigen::Vector3d& centre) {
    MapPoint point;
    point.centre = centre;
    point.normal.setZero();
    problem.map_points.push_back(point);
    BearingObservation seen;
    seen.bearing = (pose * centre).normalized();
    seen.axis = seen.bearing;
    seen.tangent.setZero();
    seen.covariance = 1e-6 * Eigen::Matrix2d::Identity();
    problem.observations.push_back(seen);
  }
};

TEST(CollinearLamps, OfARowAreWithinATwentiethOfItsLength) {
  Row row;
  EXPECT_TRUE(are_a_row(row.problem, 0, 1, 2));
  const Eigen::Vector3d across = row.along.unitOrthogonal();
  row.problem.map_points[1].centre += 0.09 * across;  // the row is 2 m long
  EXPECT_TRUE(are_a_row(row.problem, 0, 1, 2));
  EXPECT_TRUE(are_a_row(row.problem, 1, 2, 0));
  row.problem.map_points[1].centre += 0.02 * across;
  EXPECT_FALSE(are_a_row(row.problem, 0, 1, 2));
  EXPECT_FALSE(are_a_row(row.problem, 2, 1, 0));
}

TEST(CollinearLamps, AreMovedOffTheirLineOnlyIfTheyAreOnOne) {
  Random random(91, 0);
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::Vector3d from = test::random_vector(random), way = test::random_vector(random);
    Eigen::Matrix3d points;
    points << from, from + 0.3 * way, from + way;
    const Eigen::Matrix3d moved = off_their_line(points);
    const Eigen::Matrix3d by = moved - points;
    EXPECT_EQ((by.colwise().norm().array() > 0).count(), 1);
    EXPECT_LT((by.transpose() * way).norm(), 1e-12);
    EXPECT_GT(by.norm(), 1e-7 * way.norm());  // far above rounding, far below any map's error
    EXPECT_LT(by.norm(), 1e-5 * way.norm());
    points.col(1) += 1e-4 * way.unitOrthogonal();
    EXPECT_EQ(off_their_line(points), points);
  }
}

TEST(CollinearLamps, StayWhereTheyAreWhenThePoseTurnsAboutThem) {
  const Row row;
  const std::vector<Rigid3> poses = rotations_about_line(row.problem, row.assignment, row.pose);
  ASSERT_EQ(poses.size(), 12u);
  double total = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (const MapPoint& point : row.problem.map_points)
      EXPECT_LT((poses[i] * point.centre - row.pose * point.centre).norm(), 1e-12);
    const Eigen::Matrix3d step =
        poses[i].rotation.transpose() * poses[(i + 1) % poses.size()].rotation;
    EXPECT_NEAR(std::abs(so3_log(step).dot(row.along)), pi / 6, 1e-9);
    total += so3_log(step).norm();
  }
  EXPECT_NEAR(total, 2 * pi, 1e-9);
}

TEST(CollinearLamps, WithAPriorTurnToItsMinima) {
  Row row;
  const double angle = 2.2;
  const Rigid3 turned = row.pose * Rigid3{so3_exp(angle * row.along), Eigen::Vector3d::Zero()};
  Prior prior;
  prior.position_m = row.problem.from_world(turned).origin_in_source();
  prior.position_sigma_m = 0.2;
  row.options.prior = prior;
  std::vector<Rigid3> poses = rotations_about_line(row.problem, row.assignment, row.pose);
  ASSERT_EQ(poses.size(), 1u);
  const double off = so3_log(poses[0].rotation.transpose() * turned.rotation).norm();
  EXPECT_LT(off, 2.6 * pi / 180);  // half of the step of five degrees
  // A height is met by two rotations.
  prior = Prior{};
  prior.height_m = row.problem.from_world(turned).origin_in_source().z();
  row.options.prior = prior;
  poses = rotations_about_line(row.problem, row.assignment, row.pose);
  ASSERT_EQ(poses.size(), 2u);
  double nearest = 10;
  for (const Rigid3& pose : poses) {
    nearest = std::min(nearest, so3_log(pose.rotation.transpose() * turned.rotation).norm());
    EXPECT_NEAR(row.problem.from_world(pose).origin_in_source().z(), *prior.height_m, 0.2);
  }
  EXPECT_LT(nearest, 2.6 * pi / 180);
}

TEST(CollinearLamps, AppearAsALineIfTheirHeightIsWithinTheNoise) {
  // The height over the line of a fourth lamp, in sigmas of the bearings at its distance.
  Row row;
  std::vector<Pair> pairs{{0, 0}, {1, 1}, {2, 2}};
  EXPECT_TRUE(appears_collinear(row.problem, pairs, row.pose, {}));
  for (const double height : {0.005, 0.05}) {
    Row with = row;
    with.problem.options = &with.options;
    with.add(0.1 * with.along + height * with.along.unitOrthogonal());
    std::vector<Pair> all = pairs;
    all.push_back({3, 3});
    // Four sigmas of 0.001 rad at about 4 m are 0.016 m.
    EXPECT_EQ(appears_collinear(with.problem, all, with.pose, {}), height < 0.016);
    EXPECT_EQ(appears_collinear(with.problem, pairs, with.pose, {Match{3, 3}}), height < 0.016);
    for (BearingObservation& seen : with.problem.observations) seen.covariance *= 100;
    EXPECT_TRUE(appears_collinear(with.problem, all, with.pose, {}));
  }
}

}  // namespace
}  // namespace occ
