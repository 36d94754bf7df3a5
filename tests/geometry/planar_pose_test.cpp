// SPDX-License-Identifier: Apache-2.0
// Tests of poses on a floor, and of pose observations of a body that carries the camera.
#include "libocc/geometry/planar_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "libocc/core/math.hpp"
#include "libocc/geometry/pose_observation.hpp"

namespace {

using occ::pi;

occ::Rigid3 some_pose(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  occ::Vector6 delta;
  for (double& value : delta) value = normal(random);
  return occ::perturb(occ::Rigid3{}, delta);
}

occ::Vector6 unit_step(int axis, double size) {
  occ::Vector6 step = occ::Vector6::Zero();
  step[axis] = size;
  return step;
}

}  // namespace

TEST(PlanarPose, ChainsLikeItsRigidTransform) {
  const occ::PlanarPose a{1, -2, 2.5}, b{0.3, 0.7, 1.4};
  const occ::Rigid3 chained =
      occ::body_from_world(b, 0) * occ::body_from_world(a, 0.5);  // b in a's frame
  const occ::PlanarPose c = a * b;
  EXPECT_NEAR(occ::difference(occ::planar_pose(chained), c).norm(), 0, 1e-14);
  EXPECT_NEAR(chained.origin_in_source().z(), 0.5, 1e-14);
  EXPECT_NEAR(occ::difference(a * a.inverse(), occ::PlanarPose{}).norm(), 0, 1e-14);
  EXPECT_NEAR((a * b.position() - c.position()).norm(), 0, 1e-14);
}

TEST(PlanarPose, HeadingsAreWrapped) {
  EXPECT_DOUBLE_EQ(occ::wrapped_rad(pi), pi);
  EXPECT_DOUBLE_EQ(occ::wrapped_rad(-pi), pi);
  EXPECT_NEAR(occ::wrapped_rad(7), 7 - 2 * pi, 1e-15);
  EXPECT_NEAR(occ::difference(occ::PlanarPose{0, 0, -3}, occ::PlanarPose{0, 0, 3})[2], 2 * pi - 6,
              1e-15);
}

TEST(PlanarPose, ArcAgreesWithManyShortSteps) {
  for (const double turn : {0.0, 1e-9, 0.3, -2.0, 3.0}) {
    occ::PlanarPose stepped;
    constexpr int n = 2000;
    for (int i = 0; i < n; ++i) {
      stepped = stepped * occ::PlanarPose{0, 0, turn / (2 * n)} *
                occ::PlanarPose{1.5 / n, 0, turn / (2 * n)};
    }
    EXPECT_NEAR(occ::difference(stepped, occ::arc(1.5, turn)).norm(), 0, 2e-6) << turn;
  }
}

TEST(PlanarPose, LogarithmIsTheInverseOfTheExponential) {
  for (const double turn : {0.0, 1e-10, 0.4, -3.0, pi}) {
    const Eigen::Vector3d motion(0.7, -0.4, turn);
    EXPECT_NEAR((occ::planar_log(occ::planar_exp(motion)) - motion).norm(), 0, 1e-14) << turn;
    const occ::PlanarPose half = occ::planar_exp(motion / 2);
    EXPECT_NEAR(occ::difference(half * half, occ::planar_exp(motion)).norm(), 0, 1e-14) << turn;
  }
}

TEST(Adjoint, IsTheDerivativeOfAChainedTransform) {
  const occ::Rigid3 a = some_pose(1), b = some_pose(2);
  for (int axis = 0; axis < 6; ++axis) {
    const double h = 1e-6;
    const occ::Vector6 moved = (occ::difference(a * occ::perturb(b, unit_step(axis, h)), a * b) -
                                occ::difference(a * occ::perturb(b, unit_step(axis, -h)), a * b)) /
                               (2 * h);
    EXPECT_NEAR((moved - occ::adjoint(a).col(axis)).norm(), 0, 1e-8) << axis;
  }
}

TEST(PoseObservation, OfBodyHasTheCovarianceOfTheBody) {
  const occ::Rigid3 cam_from_body = some_pose(3), cam_from_world = some_pose(4);
  occ::Matrix6 root = occ::Matrix6::Identity();
  root(0, 4) = 0.5;
  root(2, 3) = -0.7;
  const occ::Matrix6 covariance = 1e-4 * root * root.transpose();
  const occ::PoseObservation seen =
      occ::PoseObservation::of_pose(2, cam_from_world, covariance, cam_from_body);
  const occ::PoseObservation body = seen.of_body();
  const occ::Matrix6 adjoint = occ::adjoint(cam_from_body.inverse());
  const occ::Matrix6 expected = adjoint * covariance * adjoint.transpose();
  EXPECT_NEAR((body.information * expected - occ::Matrix6::Identity()).norm(), 0, 1e-9);
  EXPECT_NEAR(occ::difference(body.cam_from_world, cam_from_body.inverse() * cam_from_world).norm(),
              0, 1e-14);
  EXPECT_THROW(occ::PoseObservation::of_pose(0, cam_from_world, occ::Matrix6::Zero()),
               std::invalid_argument);
}
