// SPDX-License-Identifier: Apache-2.0
// The batch smoother: exact without noise, the same minimum and covariances as Ceres finds, the
// same under changes that should not matter, consistent.
#include "libocc/smooth/smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/smooth/consistency.hpp"
#include "tests/smooth/ceres_smoother.hpp"
#include "tests/smooth/smoother_support.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
namespace {

/// As they are written in the oracle: nothing is added to odometry's covariance.
SmootherOptions bare(double huber_sigmas, double link_gate) {
  SmootherOptions options;
  options.huber_sigmas = huber_sigmas;
  options.link_gate = link_gate;
  options.min_odometry_sigma_m = options.min_odometry_sigma_rad = 0;
  return options;
}

double worst_error(const Drive& drive, const Smoothing<SmoothedPose>& found) {
  double worst = 0;
  for (std::size_t k = 0; k < drive.truth.size(); ++k)
    worst = std::max(worst, difference(found.poses[k].body_from_world, drive.truth[k]).norm());
  return worst;
}

double worst_error(const PlanarDrive& drive, const Smoothing<SmoothedPlanarPose>& found) {
  double worst = 0;
  for (std::size_t k = 0; k < drive.truth.size(); ++k)
    worst = std::max(worst, difference(found.poses[k].pose, drive.truth[k]).norm());
  return worst;
}

TEST(Smoother, IsExactWithoutNoise) {
  const Drive drive = room_drive(1, 12, 0);
  const auto found = smooth(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(worst_error(drive, *found), 1e-9);
  EXPECT_LT(found->chi2, 1e-12);
  EXPECT_EQ(found->dof, 12 * 6 * 2 + 11 * 6 - 12 * 6);
}

TEST(Smoother, IsExactWithoutNoiseOnAFloor) {
  const PlanarDrive drive = planar_drive(1, 12, 0);
  const auto found = smooth_planar(drive.input);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(worst_error(drive, *found), 1e-9);
  EXPECT_EQ(found->dof, 12 * 6 * 2 + 11 * 3 - 12 * 3);
}

void expect_as_ceres(const Drive& drive, double huber_sigmas, double link_gate) {
  const auto found = smooth(drive.input, bare(huber_sigmas, link_gate));
  ASSERT_TRUE(found.ok()) << found.message;
  for (const OdometryLink& link : found->links) ASSERT_EQ(link.factor, 1);
  const double corner = link_gate > 0 ? std::sqrt(chi2_quantile(1 - link_gate, 6)) : 0;
  const CeresAnswer oracle = ceres_smooth(drive.input, drive.truth, huber_sigmas, corner);
  EXPECT_NEAR(found->chi2 / 2, oracle.cost, 1e-9 * oracle.cost);
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const Rigid3 theirs = perturb(drive.truth[k], oracle.poses.col(i));
    EXPECT_LT(difference(found->poses[k].body_from_world, theirs).norm(), 1e-7) << k;
    if (huber_sigmas > 0) continue;
    // Theirs is of the parameters; both perturbations differ by a Jacobian close to one.
    const Eigen::MatrixXd covariance = oracle.covariance.block(6 * i, 6 * i, 6, 6);
    EXPECT_LT((found->poses[k].covariance - covariance).norm(), 0.02 * covariance.norm()) << k;
  }
}

TEST(Smoother, FindsCeressMinimum) { expect_as_ceres(room_drive(2, 15), 0, 0); }

TEST(Smoother, FindsCeressMinimumWithWrongSightings) {
  Drive drive = room_drive(3, 15);
  drive.input.frames[4].sightings[2].px += Eigen::Vector2d(20, -7);
  drive.input.frames[9].sightings[0].px += Eigen::Vector2d(-3, 2);
  expect_as_ceres(drive, 3, 1e-12);
}

TEST(Smoother, FindsCeressMinimumWithObservedPosesAndCorrelatedSightings) {
  Drive drive = room_drive(4, 8);
  Random random(5);
  const Rigid3 cam_from_body{so3_exp({0.3, -2, 1}), {1, 0.2, -0.3}};
  for (const std::size_t k : {1u, 6u}) {
    Eigen::MatrixXd root = Eigen::MatrixXd::Zero(6, 8);
    for (int i = 0; i < 48; ++i) root(i % 6, i / 6) = 0.003 * random.normal();
    const Matrix6 covariance = root * root.transpose();
    const Rigid3 seen = perturb(cam_from_body * drive.truth[k], random_part(random, 0.01, 0.01));
    drive.input.observations.push_back(
        PoseObservation::of_pose(drive.input.frames[k].time_s, seen, covariance, cam_from_body));
  }
  for (SmootherFrame& frame : drive.input.frames)
    for (PointSighting& seen : frame.sightings) {
      const double shared = 0.07 * random.uniform(-1, 1);
      seen.covariance_px2 << 0.2, shared, shared, 0.1;
    }
  expect_as_ceres(drive, 0, 0);
}

TEST(Smoother, FindsCeressMinimumOnAFloor) {
  PlanarDrive drive = planar_drive(6, 20);
  PlanarPrior prior;
  prior.pose = {1.62, 1.69, 0.42};
  prior.covariance << 4e-4, 1e-5, 0, 1e-5, 3e-4, -2e-5, 0, -2e-5, 1e-4;
  drive.input.priors.push_back(prior);
  const auto found = smooth_planar(drive.input, bare(0, 0));
  ASSERT_TRUE(found.ok()) << found.message;
  const CeresAnswer oracle = ceres_smooth(drive.input, drive.truth, 0, 0);
  EXPECT_NEAR(found->chi2 / 2, oracle.cost, 1e-9 * oracle.cost);
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const PlanarPose& pose = found->poses[k].pose;
    const PlanarPose theirs{oracle.poses(0, i), oracle.poses(1, i), oracle.poses(2, i)};
    EXPECT_LT(difference(pose, theirs).norm(), 1e-7) << k;
    const Eigen::Matrix3d covariance = oracle.covariance.block<3, 3>(3 * i, 3 * i);
    EXPECT_LT((found->poses[k].covariance - covariance).norm(), 1e-6 * covariance.norm()) << k;
  }
}

TEST(Smoother, DoesNotDependOnTheWorldsFrame) {
  const Drive drive = room_drive(7, 10);
  Random random(8);
  const Rigid3 world_from_new = random_pose(random);
  SmootherInput moved = drive.input;
  for (SmootherFrame& frame : moved.frames)
    for (PointSighting& seen : frame.sightings)
      seen.point_in_world = world_from_new.inverse() * seen.point_in_world;
  const auto here = smooth(drive.input), there = smooth(moved);
  ASSERT_TRUE(here.ok() && there.ok());
  EXPECT_NEAR(here->chi2, there->chi2, 1e-8 * here->chi2);
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    const SmoothedPose &a = here->poses[k], &b = there->poses[k];
    EXPECT_LT(difference(b.body_from_world, a.body_from_world * world_from_new).norm(), 1e-8);
    // The perturbation is on the body's side, so the other world's covariance is the same.
    EXPECT_LT((a.covariance - b.covariance).norm(), 1e-6 * a.covariance.norm());
  }
}

TEST(Smoother, DoesNotDependOnTheOrderOfLampsOrOnTheClock) {
  const Drive drive = room_drive(9, 10);
  SmootherInput other = drive.input;
  for (SmootherFrame& frame : other.frames) {
    std::reverse(frame.sightings.begin(), frame.sightings.end());
    frame.time_s += 1e5;
  }
  for (Odometry& odometry : other.odometry) {
    odometry.from_s += 1e5;
    odometry.to_s += 1e5;
  }
  const auto a = smooth(drive.input), b = smooth(other);
  for (std::size_t k = 0; k < drive.truth.size(); ++k)
    EXPECT_LT(difference(a->poses[k].body_from_world, b->poses[k].body_from_world).norm(), 1e-9);
  EXPECT_TRUE(a.ok() && b.ok());
}

TEST(Smoother, IsTheSameBackwards) {
  const Drive drive = room_drive(10, 10);
  SmootherInput back;
  for (std::size_t k = drive.truth.size(); k-- > 0;) {
    back.frames.push_back(drive.input.frames[k]);
    back.frames.back().time_s *= -1;
  }
  for (std::size_t k = drive.input.odometry.size(); k-- > 0;) {
    const Odometry& forth = drive.input.odometry[k];
    const Matrix6 carried = adjoint(forth.to_from_from.inverse());
    back.odometry.push_back({-forth.to_s, -forth.from_s, forth.to_from_from.inverse(),
                             carried * forth.covariance * carried.transpose()});
  }
  const auto a = smooth(drive.input), b = smooth(back);
  ASSERT_TRUE(a.ok() && b.ok());
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    const SmoothedPose &one = a->poses[k], &two = b->poses[drive.truth.size() - 1 - k];
    // The noise of the inverse is that of the step to first order.
    EXPECT_LT(difference(one.body_from_world, two.body_from_world).norm(), 1e-5);
    EXPECT_LT((one.covariance - two.covariance).norm(), 1e-2 * one.covariance.norm());
  }
}

TEST(Smoother, TakesSeveralCamerasAtOneTime) {
  const Drive drive = room_drive(11, 6);
  SmootherInput two;
  two.odometry = drive.input.odometry;
  const Rigid3 other_from_body{so3_exp({-0.1, 0.2, -2}), {-0.2, 0.1, 0}};
  Random random(12);
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    SmootherFrame second = drive.input.frames[k];
    two.frames.push_back(second);
    second.cam_from_body = other_from_body;
    for (PointSighting& seen : second.sightings)
      seen = sighting(second.camera, other_from_body * drive.truth[k], seen.point_in_world, 0.3,
                      &random);
    two.frames.push_back(second);
  }
  const auto one = smooth(drive.input), both = smooth(two);
  ASSERT_TRUE(both.ok()) << both.message;
  ASSERT_EQ(both->poses.size(), drive.truth.size());
  EXPECT_EQ(both->residual_sigmas.size(), 2 * drive.truth.size());
  for (std::size_t k = 0; k < drive.truth.size(); ++k)
    EXPECT_LT(both->poses[k].covariance.trace(), 0.8 * one->poses[k].covariance.trace());
}

/// Quadratic approximation of the sightings' chi2 about a nearby pose of the camera.
PoseObservation observation_of(const SmootherFrame& frame, const Rigid3& cam_from_world) {
  PoseObservation out;
  out.time_s = frame.time_s;
  out.cam_from_world = cam_from_world;
  out.cam_from_body = frame.cam_from_body;
  for (const PointSighting& seen : frame.sightings) {
    const Eigen::Vector3d in_cam = cam_from_world * seen.point_in_world;
    Eigen::Matrix<double, 2, 3> d_point;
    const Eigen::Vector2d off = *frame.camera.project(in_cam, &d_point) - seen.px;
    Eigen::Matrix<double, 2, 6> jacobian;
    jacobian << -d_point * skew(in_cam), d_point;
    const Eigen::Matrix2d weight = seen.covariance_px2.inverse();
    out.information += jacobian.transpose() * weight * jacobian;
    out.gradient += jacobian.transpose() * weight * off;
  }
  return out;
}

// One lamp, two or none in a frame: singular information, and still worth as much as the sightings.
TEST(Smoother, ObservationsOfFewLampsAreWorthTheirSightings) {
  Drive drive = room_drive(16, 12);
  Random random(17);
  for (std::size_t k = 0; k < drive.truth.size(); ++k)
    drive.input.frames[k].sightings.resize(k % 4 == 0 ? 6 : k % 4 - 1);
  SmootherInput observed = drive.input;
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    SmootherFrame& frame = observed.frames[k];
    const Rigid3 close = perturb(drive.truth[k], random_part(random, 5e-4, 5e-4));
    observed.observations.push_back(observation_of(frame, frame.cam_from_body * close));
    frame.sightings.clear();
  }
  observed.start = drive.truth;
  const auto seen = smooth(drive.input, bare(0, 0)), told = smooth(observed, bare(0, 0));
  ASSERT_TRUE(seen.ok() && told.ok()) << seen.message << told.message;
  for (std::size_t k = 0; k < drive.truth.size(); ++k) {
    const SmoothedPose &a = seen->poses[k], &b = told->poses[k];
    const Vector6 off = difference(a.body_from_world, b.body_from_world);
    EXPECT_LT(test::nees(off, a.covariance), 1e-3) << k;
    EXPECT_LT((a.covariance - b.covariance).norm(), 0.02 * a.covariance.norm()) << k;
  }
  // The residuals within a frame, which tell nothing of its pose, are not in the observations.
  EXPECT_LT(told->chi2, seen->chi2);
}

TEST(Smoother, CutsOdometryWhereFramesAre) {
  Drive fine = room_drive(13, 13, 0);
  SmootherInput coarse;
  for (std::size_t k = 0; k < 13; k += 3) coarse.frames.push_back(fine.input.frames[k]);
  coarse.frames[2].sightings.clear();  // held by odometry alone
  coarse.odometry = fine.input.odometry;
  const auto chained = smooth(coarse);
  ASSERT_TRUE(chained.ok()) << chained.message;
  for (std::size_t k = 0; k < 5; ++k)
    EXPECT_LT(difference(chained->poses[k].body_from_world, fine.truth[3 * k]).norm(), 1e-9);
  EXPECT_GT(chained->poses[2].covariance.trace(), 3 * chained->poses[0].covariance.trace());

  // One long piece at a constant velocity is the same as its parts.
  const PlanarPose step = arc(0.6, 0.9);
  PlanarSmootherInput whole;
  whole.frames.resize(4);
  for (int k = 0; k < 4; ++k) whole.frames[k].time_s = k;
  whole.priors.push_back({0, {1, 2, 3}, 1e-4 * Eigen::Matrix3d::Identity()});
  whole.odometry.push_back({0, 3, step, 1e-4 * Eigen::Matrix3d::Identity()});
  const auto cut = smooth_planar(whole);
  ASSERT_TRUE(cut.ok()) << cut.message;
  EXPECT_LT(difference(cut->poses[1].pose, PlanarPose{1, 2, 3} * arc(0.2, 0.3)).norm(), 1e-9);
  EXPECT_LT(difference(cut->poses[3].pose, PlanarPose{1, 2, 3} * step).norm(), 1e-9);
}

TEST(Smoother, StartsFromAPoseThatIsFarOff) {
  const Drive drive = room_drive(14, 10);
  SmootherInput far = drive.input;
  Random random(15);
  for (const Rigid3& pose : drive.truth)
    far.start.push_back(perturb(pose, random_part(random, 0.15, 0.2)));
  const auto from_far = smooth(far), usual = smooth(drive.input);
  ASSERT_TRUE(from_far.ok()) << from_far.message;
  EXPECT_NEAR(from_far->chi2, usual->chi2, 1e-8 * usual->chi2);
}

template <class Run>
void expect_consistent(int runs, int poses, int size, const Run& run) {
  Eigen::MatrixXd squared(runs, poses);
  double chi2 = 0;
  int dof = 0;
  for (int i = 0; i < runs; ++i) run(i, squared, chi2, dof);
  const auto report = nees(squared, Eigen::MatrixXi::Constant(runs, poses, size), 0.99);
  EXPECT_EQ(report.verdict, Consistency::consistent) << report.mean << " > " << report.high;
  const auto [low, high] = chi2_interval(dof);
  EXPECT_GT(chi2, low);
  EXPECT_LT(chi2, high);
}

TEST(Smoother, IsConsistent) {
  expect_consistent(30, 12, 6, [](int i, Eigen::MatrixXd& squared, double& chi2, int& dof) {
    const Drive drive = room_drive(static_cast<std::uint64_t>(100 + i), 12);
    const auto found = smooth(drive.input, bare(0, 0));
    for (int k = 0; k < 12; ++k) {
      const SmoothedPose& pose = found->poses[k];
      squared(i, k) = normalised_squared_error(difference(drive.truth[k], pose.body_from_world),
                                               pose.covariance);
    }
    chi2 += found->chi2;
    dof += found->dof;
  });
}

TEST(Smoother, IsConsistentOnAFloor) {
  expect_consistent(30, 12, 3, [](int i, Eigen::MatrixXd& squared, double& chi2, int& dof) {
    const PlanarDrive drive = planar_drive(static_cast<std::uint64_t>(200 + i), 12);
    const auto found = smooth_planar(drive.input, bare(0, 0));
    for (int k = 0; k < 12; ++k) {
      const SmoothedPlanarPose& pose = found->poses[k];
      squared(i, k) =
          normalised_squared_error(difference(drive.truth[k], pose.pose), pose.covariance);
    }
    chi2 += found->chi2;
    dof += found->dof;
  });
}

}  // namespace
}  // namespace occ::test
