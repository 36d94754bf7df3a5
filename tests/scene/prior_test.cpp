// SPDX-License-Identifier: Apache-2.0
// Combinations of priors: heights, sigmas per axis, a last pose with its covariance;
// contradictions.
#include "libocc/scene/prior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using test::complaint;

const Rigid3 pose = look_at({1, 2, 0.5}, {1.2, 2.1, 3}, Vector3d::UnitY());

Prior all_of_it() {
  Prior prior;
  prior.position_m = pose.origin_in_source();
  prior.height_m = 0.5;
  prior.heading_rad = heading_rad(pose);
  prior.gravity_in_cam = -pose.rotation.col(2);
  prior.last_pose = PriorPose{pose, 1e-4 * Matrix6::Identity()};
  return prior;
}

TEST(PriorMix, TheTruthHasZeroChi2AndNoContradiction) {
  const Prior prior = all_of_it();
  EXPECT_NO_THROW(prior.validate());
  EXPECT_NEAR(prior.chi2(pose), 0, 1e-18);
}

TEST(PriorMix, AHeightAloneIsAPrior) {
  Prior by_height, by_position;
  by_height.height_m = 0.8;
  by_height.height_sigma_m = 0.1;
  const double unknown = std::numeric_limits<double>::infinity();
  by_position.position_m = Vector3d(77, -5, 0.8);
  by_position.position_sigmas_m = Vector3d(unknown, unknown, 0.1);
  for (const Prior& prior : {by_height, by_position}) {
    EXPECT_FALSE(prior.empty());
    EXPECT_NO_THROW(prior.validate());
    EXPECT_NEAR(prior.chi2(pose), 9, 1e-9);
  }
}

TEST(PriorMix, EachAxisHasItsSigma) {
  Prior prior;
  prior.position_m = pose.origin_in_source() + Vector3d(0.1, -0.4, 0.9);
  prior.position_sigmas_m = Vector3d(0.1, 0.2, 0.3);
  EXPECT_NEAR(prior.chi2(pose), 1 + 4 + 9, 1e-9);
}

TEST(PriorMix, ALastPoseIsWeightedByItsCovariance) {
  Random random(1);
  Prior prior;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix<double, 6, 6> root =
        Eigen::Matrix<double, 6, 6>::NullaryExpr([&] { return 0.1 * random.normal(); });
    prior.last_pose =
        PriorPose{test::random_pose(random), root * root.transpose() + 1e-4 * Matrix6::Identity()};
    const Vector6 z = Vector6::NullaryExpr([&] { return random.normal(); });
    const Vector6 step = prior.last_pose->covariance.llt().matrixL() * z;
    const Rigid3 moved = perturb(prior.last_pose->cam_from_world, step);
    EXPECT_NEAR(prior.chi2(moved), z.squaredNorm(), 1e-6 * z.squaredNorm());
  }
}

void expect_contradiction(const Prior& prior, const std::string& a, const std::string& b) {
  const std::string said = complaint([&] { prior.validate(); });
  EXPECT_EQ(said.find("prior." + a + " and prior." + b + " contradict each other"), 0u) << said;
}

TEST(PriorMix, ContradictionsNameBothParts) {
  Prior prior = all_of_it();
  prior.position_m->x() += 5;
  expect_contradiction(prior, "position_m", "last_pose");
  prior.last_pose->covariance = 4 * Matrix6::Identity();  // within the larger covariance
  EXPECT_NO_THROW(prior.validate());

  prior = all_of_it();
  prior.height_m = 3.4;
  prior.last_pose.reset();
  expect_contradiction(prior, "position_m", "height_m");
  prior = all_of_it();
  prior.height_m = 1;
  prior.position_m.reset();
  expect_contradiction(prior, "height_m", "last_pose");

  prior = all_of_it();
  prior.heading_rad = *prior.heading_rad + 2;
  expect_contradiction(prior, "heading_rad", "last_pose");
  prior.heading_rad = *prior.heading_rad - 2 + 2 * pi;  // a full rotation changes nothing
  EXPECT_NO_THROW(prior.validate());

  prior = all_of_it();
  prior.gravity_in_cam = Vector3d(pose.rotation.col(2));
  expect_contradiction(prior, "gravity_in_cam", "last_pose");
  Prior gravity;
  gravity.gravity_in_cam = prior.gravity_in_cam;
  EXPECT_NEAR(std::sqrt(gravity.chi2(pose)), pi / gravity.gravity_sigma_rad, 1e-6) << "upside down";
}

TEST(PriorMix, ErrorsAsLargeAsStatedAreNoContradiction) {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    Prior prior = all_of_it();
    const Vector6 step = Vector6::NullaryExpr([&] { return 0.01 * random.normal(); });
    prior.last_pose->cam_from_world = perturb(pose, step);
    *prior.position_m += 0.5 * test::random_vector(random);
    *prior.height_m += 0.05 * random.normal();
    *prior.heading_rad += 0.35 * random.normal();
    prior.gravity_in_cam = so3_exp(0.014 * test::random_vector(random)) * -pose.rotation.col(2);
    EXPECT_NO_THROW(prior.validate());
  }
}

TEST(PriorMix, ValidateNamesFieldAndValue) {
  Prior prior;
  prior.height_m = std::nan("");
  EXPECT_EQ(complaint([&] { prior.validate(); }), "prior.height_m must be finite, got nan");
  prior = {};
  prior.position_sigmas_m = Vector3d(1, 0, 1);
  EXPECT_EQ(complaint([&] { prior.validate(); }),
            "prior.position_sigmas_m must be positive, got [1, 0, 1]");
  for (int axis = 0; axis < 3; ++axis) {
    prior.position_m = Vector3d(1, 2, 3);
    prior.position_sigmas_m = Vector3d(1, 1, 1);
    (*prior.position_sigmas_m)[axis] = std::nan("");
    EXPECT_NE(complaint([&] { prior.validate(); }).find("prior.position_sigmas_m must be"),
              std::string::npos)
        << axis;
  }
  prior = {};
  prior.last_pose = PriorPose{pose, -Matrix6::Identity()};
  EXPECT_EQ(complaint([&] { prior.validate(); }).find("prior.last_pose's covariance must be"), 0u);
}

}  // namespace
}  // namespace occ
