// SPDX-License-Identifier: Apache-2.0
// Pose of a camera of known tilt and height from two points, or from one point and a heading.
#include "libocc/pose/solvers/planar.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using TwoColumns = Eigen::Matrix<double, 3, 2>;

struct Known {
  Rigid3 pose;
  TwoColumns points, bearings;
  PlanarCamera camera;
};

void look(Known& known) {
  known.camera.up_in_cam = known.pose.rotation.col(2);
  known.camera.height_m = known.pose.origin_in_source().z();
  for (int i = 0; i < 2; ++i)
    known.bearings.col(i) = (known.pose * Vector3d(known.points.col(i))).normalized();
}

Known random_known(Random& random) {
  Known known;
  known.pose = test::random_pose(random);
  for (int i = 0; i < 2; ++i) known.points.col(i) = 3 * test::random_vector(random);
  look(known);
  return known;
}

double error(const Rigid3& a, const Rigid3& b) {
  return (a.origin_in_source() - b.origin_in_source()).norm() + (a.rotation - b.rotation).norm();
}

// The second bearing touches the circle about the first point on which the second one is, or misses
// it by `beyond`, relative to the squared lengths.
TEST(PlanarPoses, ABearingBesideItsCircleHasNoPose) {
  for (const double beyond : {-1e-3, 0.0, 1e-13, 1e-9, 1e-3}) {
    Known known;
    const double away = 2, turn = 0.5, sine2 = std::sin(turn) * std::sin(turn);
    const double distance2 = away * away * (sine2 - beyond * (1 + sine2));
    known.points << away, away + std::sqrt(distance2), 0, 0, 2, 0.1;
    known.bearings << away, std::cos(turn), 0, std::sin(turn), 2, 0.05;
    known.bearings.colwise().normalize();
    known.camera.up_in_cam = Vector3d::UnitZ();
    const auto found = planar_poses(known.bearings, known.points, known.camera);
    EXPECT_EQ(found.size(), beyond > 1e-12 ? 0u : 2u) << beyond;
  }
}

TEST(PlanarPoses, TwoPointsGiveTheTruthFirst) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Known known = random_known(random);
    const auto found = planar_poses(known.bearings, known.points, known.camera);
    ASSERT_GE(found.size(), 1u);
    ASSERT_LE(found.size(), 2u);
    const double nearest_m =
        std::abs((known.points.row(2).array() - known.camera.height_m).maxCoeff());
    EXPECT_LT(error(found.front().cam_from_world, known.pose),
              1e-6 / std::min(1.0, nearest_m * nearest_m));
    EXPECT_LT(found.front().misfit_rad, 1e-6);
    for (const PoseCandidate& c : found) {  // tilt and height are kept
      EXPECT_LT((c.cam_from_world.rotation.col(2) - known.camera.up_in_cam).norm(), 1e-9);
      EXPECT_NEAR(c.cam_from_world.origin_in_source().z(), known.camera.height_m,
                  1e-6 * (1 + known.points.norm()));
    }
  }
}

// The bearing of a point at the camera's height only determines an azimuth: both poses may be
// right.
TEST(PlanarPoses, APointAtTheCamerasHeightLeavesTwo) {
  Random random(2);
  int two = 0;
  for (int i = 0; i < 200; ++i) {
    Known known = random_known(random);
    known.points(2, 1) = known.pose.origin_in_source().z();
    look(known);
    const auto found = planar_poses(known.bearings, known.points, known.camera);
    ASSERT_GE(found.size(), 1u);
    double smallest = 1e9;
    for (const PoseCandidate& c : found) {
      smallest = std::min(smallest, error(c.cam_from_world, known.pose));
      EXPECT_LT(c.misfit_rad, 1e-6);
    }
    EXPECT_LT(smallest, 1e-3);
    two += found.size() == 2;
  }
  EXPECT_GT(two, 20);
}

TEST(PlanarPoses, OnePointAndAHeadingGiveTheTruth) {
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Known known = random_known(random);
    const auto found = planar_poses(Vector3d(known.bearings.col(0)), known.points.col(0),
                                    heading_rad(known.pose), known.camera);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_LT(error(found.front().cam_from_world, known.pose), 1e-6);
  }
}

TEST(PlanarPoses, ReturnsNothingForAnUndeterminedHeading) {
  Random random(4);
  Known known = random_known(random);
  const double height = known.pose.origin_in_source().z();
  known.points.row(2).setConstant(height);
  look(known);
  EXPECT_TRUE(planar_poses(known.bearings, known.points, known.camera).empty());
  EXPECT_TRUE(
      planar_poses(Vector3d(known.bearings.col(0)), known.points.col(0), 0, known.camera).empty());
  known = random_known(random);
  known.points.col(1) = known.points.col(0) + Vector3d(0, 0, 0.7);  // one above the other
  look(known);
  EXPECT_TRUE(planar_poses(known.bearings, known.points, known.camera).empty());
  known = random_known(random);
  known.camera.height_m = known.points.row(2).maxCoeff() + 1;  // both are below, yet seen above
  known.camera.up_in_cam = known.bearings.col(0);
  EXPECT_TRUE(planar_poses(known.bearings, known.points, known.camera).empty());
}

TEST(PlanarPoses, MisfitRevealsAWrongAssignment) {
  Random random(5);
  int large = 0, pairs = 0;
  for (int i = 0; i < 200; ++i) {
    Known known = random_known(random);
    known.points.col(1) = 3 * test::random_vector(random);  // position of another lamp
    for (const PoseCandidate& c : planar_poses(known.bearings, known.points, known.camera)) {
      ++pairs;
      large += c.misfit_rad > 0.01;
    }
  }
  EXPECT_GT(large, 0.95 * pairs);
}

TEST(PlanarPoses, RejectsBearingsThatAreNotUnit) {
  Random random(6);
  Known known = random_known(random);
  known.bearings *= 2;
  EXPECT_NE(test::complaint([&] {
              planar_poses(known.bearings, known.points, known.camera);
            }).find("bearings[0]"),
            std::string::npos);
}

}  // namespace
}  // namespace occ
