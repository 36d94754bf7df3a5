// SPDX-License-Identifier: Apache-2.0
// Least-squares pose from bearings: derivatives, exactness, and the minimum.
#include "libocc/pose/internal/point_fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "libocc/core/statistics.hpp"
#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
using namespace internal::pose;
namespace {

using Rows = Eigen::Matrix<double, 2, 3>;

struct Seen {
  KnownProblem known;
  std::vector<Rows> across;  ///< rows orthogonal to each bearing, divided by its sigmas
  SeenPoints points;
};

// Adds `noise_rad` to the bearings; sigmas differ with the direction across a bearing.
Seen random_seen(Random& random, int count, const ProblemKind& kind, double noise_rad,
                 double sigma_rad) {
  Seen seen;
  seen.known = random_problem(random, count, kind);
  PoseProblem& p = seen.known.problem;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d bearing =
        (p.bearings.col(i) + noise_rad * random_vector(random)).normalized();
    p.bearings.col(i) = bearing;
    const Eigen::Vector3d a = bearing.cross(random_vector(random)).normalized();
    Rows rows;
    rows << a.transpose() / (sigma_rad * random.uniform(0.5, 2)),
        bearing.cross(a).transpose() / (sigma_rad * random.uniform(0.5, 2));
    seen.across.push_back(rows);
    seen.points.add(p.points.col(i), bearing, rows,
                    kind.rig ? Eigen::Vector3d(p.origins.col(i)) : Eigen::Vector3d::Zero());
  }
  return seen;
}

// Rotation about the points' origin, then a translation, along the camera's axes.
Rigid3 moved(const Rigid3& pose, const Vector6& step) {
  return {so3_exp(step.head<3>()) * pose.rotation, pose.translation + step.tail<3>()};
}

// Residuals as defined in the header, one by one.
Eigen::VectorXd residuals(const Seen& seen, const Rigid3& pose) {
  const PoseProblem& p = seen.known.problem;
  Eigen::VectorXd r(2 * p.size());
  for (int i = 0; i < p.size(); ++i) {
    Eigen::Vector3d x = pose * Eigen::Vector3d(p.points.col(i));
    if (p.origins.cols() > 0) x -= p.origins.col(i);
    r.segment<2>(2 * i) = seen.across[i] * x / p.bearings.col(i).dot(x);
  }
  return r;
}

Eigen::MatrixXd residuals_by_step(const Seen& seen, const Rigid3& pose) {
  return numerical_jacobian(
      [&](const Eigen::VectorXd& s) { return residuals(seen, moved(pose, s)); },
      Eigen::VectorXd::Zero(6));
}

Rigid3 start_near(const Seen& seen, Random& random, double size) {
  Vector6 step;
  step << random_vector(random), random_vector(random);
  return moved(seen.known.truth, size * step);
}

TEST(PointFit, EquationsAreThoseOfTheResiduals) {
  for (int count = 3; count <= 9; ++count)
    for (const bool rig : {false, true}) {
      Random random(1, static_cast<std::uint64_t>(count));
      const Seen seen = random_seen(random, count, {false, rig, false}, 0.02, 0.05);
      const Rigid3 pose = start_near(seen, random, 0.03);
      const Eigen::VectorXd r = residuals(seen, pose);
      const Eigen::MatrixXd j = residuals_by_step(seen, pose);
      const PointEquations e = point_equations(seen.points, pose);
      EXPECT_EQ(seen.points.count(), count);
      EXPECT_NEAR(e.chi2, r.squaredNorm(), 1e-12 * r.squaredNorm());
      EXPECT_NEAR(point_chi2(seen.points, pose), e.chi2, 1e-12 * e.chi2);
      EXPECT_TRUE(jacobian_agrees(e.gradient, j.transpose() * r)) << count;
      EXPECT_TRUE(jacobian_agrees(e.information, j.transpose() * j)) << count;
      EXPECT_EQ(e.information, e.information.transpose());
    }
}

TEST(PointFit, CheckRejectsWrongEquations) {
  Random random(2);
  const Seen seen = random_seen(random, 5, {}, 0.02, 0.05);
  const Rigid3 pose = start_near(seen, random, 0.03);
  const Eigen::MatrixXd j = residuals_by_step(seen, pose);
  PointEquations wrong = point_equations(seen.points, pose);
  wrong.information(1, 4) *= 1.001;
  wrong.gradient *= 1.0001;
  EXPECT_FALSE(jacobian_agrees(wrong.information, j.transpose() * j));
  EXPECT_FALSE(jacobian_agrees(wrong.gradient, j.transpose() * residuals(seen, pose)));
  // The library's other convention, a rotation about the camera, has other equations.
  const Eigen::MatrixXd about_camera = numerical_jacobian(
      [&](const Eigen::VectorXd& s) { return residuals(seen, perturb(pose, s)); },
      Eigen::VectorXd::Zero(6));
  EXPECT_FALSE(jacobian_agrees(point_equations(seen.points, pose).information,
                               about_camera.transpose() * about_camera));
}

TEST(PointFit, APointThatIsNotInFrontHasNoLikelihood) {
  Random random(3);
  for (int count = 3; count <= 6; ++count) {
    const Seen seen = random_seen(random, count, {}, 0, 1);
    Rigid3 behind = seen.known.truth;
    behind.translation *= -1;
    EXPECT_EQ(point_chi2(seen.points, behind), std::numeric_limits<double>::infinity());
    EXPECT_EQ(point_equations(seen.points, behind).chi2, std::numeric_limits<double>::infinity());
    EXPECT_FALSE(std::isfinite(fit_points(seen.points, behind, 10, 1e-9).equations.chi2));
  }
}

TEST(PointFit, CopiesPointsFromAnother) {
  for (const bool rig : {false, true}) {
    Random random(4, rig);
    const Seen seen = random_seen(random, 7, {false, rig, false}, 0.01, 0.05);
    SeenPoints same;
    for (int i = 0; i < 7; ++i) same.add(seen.points, i);
    const Rigid3 pose = start_near(seen, random, 0.05);
    EXPECT_EQ(same.count(), 7);
    EXPECT_NEAR(point_chi2(same, pose), point_chi2(seen.points, pose),
                1e-12 * point_chi2(seen.points, pose))
        << "rig: " << rig;
  }
}

TEST(PointFit, IsExactWithoutNoise) {
  for (const bool rig : {false, true})
    for (int i = 0; i < 300; ++i) {
      Random random(5, static_cast<std::uint64_t>(i));
      const Seen seen = random_seen(random, 4 + i % 7, {i % 2 == 1, rig, i % 3 == 0}, 0, 1);
      const PointFit fit = fit_points(seen.points, start_near(seen, random, 0.02), 50, 1e-15);
      EXPECT_LT(pose_error(fit.pose, seen.known.truth), 1e-12) << i;
      EXPECT_LT(
          (fit.pose.rotation.transpose() * fit.pose.rotation - Eigen::Matrix3d::Identity()).norm(),
          1e-14);
    }
}

// Gauss-Newton with derivatives by central differences, to convergence.
Rigid3 minimum_by_differences(const Seen& seen, Rigid3 pose) {
  for (int i = 0; i < 40; ++i) {
    const Eigen::MatrixXd j = residuals_by_step(seen, pose);
    const Vector6 step = -j.colPivHouseholderQr().solve(residuals(seen, pose));
    pose = moved(pose, step);
    if (step.norm() < 1e-13) break;
  }
  return pose;
}

double sigmas_apart(const Rigid3& a, const Rigid3& b, const Matrix6& information) {
  Vector6 apart;
  apart << so3_log(a.rotation * b.rotation.transpose()), a.translation - b.translation;
  return std::sqrt(apart.dot(information * apart));
}

TEST(PointFit, ReachesTheMinimumOfCentralDifferences) {
  for (const bool rig : {false, true})
    for (int i = 0; i < 60; ++i) {
      Random random(6, static_cast<std::uint64_t>(i));
      const Seen seen = random_seen(random, 4 + i % 6, {i % 2 == 1, rig, false}, 1e-3, 1e-3);
      const PointFit fit = fit_points(seen.points, seen.known.truth, 50, 1e-9);
      const Rigid3 expected = minimum_by_differences(seen, seen.known.truth);
      EXPECT_TRUE(fit.converged);
      EXPECT_LT(sigmas_apart(fit.pose, expected, fit.equations.information), 1e-6) << i;
    }
}

TEST(PointFit, EquationsAreThoseAtTheReturnedPose) {
  for (const double tolerance : {1e-9, 1e-3, 1.0}) {
    Random random(7);
    const Seen seen = random_seen(random, 6, {}, 1e-3, 1e-3);
    for (const int max_iterations : {1, 2, 30}) {
      const PointFit fit =
          fit_points(seen.points, start_near(seen, random, 0.1), max_iterations, tolerance);
      const PointEquations e = point_equations(seen.points, fit.pose);
      EXPECT_NEAR(fit.equations.chi2, e.chi2, 1e-9 * e.chi2);
      EXPECT_TRUE(jacobian_agrees(fit.equations.information, e.information, 1e-9));
    }
  }
}

// The remaining step is below the tolerance, in well-conditioned and ill-conditioned views: far
// away a plane's tilt and its position along the view are strongly correlated.
TEST(PointFit, LeavesNoMoreThanTheTolerance) {
  constexpr double tolerance = 1e-3;
  for (const double distance : {2.0, 10.0, 50.0}) {
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
      Random random(8, static_cast<std::uint64_t>(i));
      ProblemKind kind{true, false, false, distance, 1.001 * distance};
      const double sigma = 0.01 / (distance * distance);
      const Seen seen = random_seen(random, 4 + i % 3, kind, sigma, sigma);
      const Rigid3 start = start_near(seen, random, 0.1 * sigma);
      const PointFit fit = fit_points(seen.points, start, 60, tolerance);
      const PointFit tight = fit_points(seen.points, fit.pose, 200, 1e-12);
      ASSERT_TRUE(fit.converged);
      worst = std::max(worst, sigmas_apart(fit.pose, tight.pose, tight.equations.information));
    }
    EXPECT_LT(worst, 2 * tolerance) << "at " << distance << " sizes";
  }
}

TEST(PointFit, ReportsThatItStoppedEarly) {
  Random random(9);
  const Seen seen = random_seen(random, 6, {}, 1e-3, 1e-3);
  const Rigid3 start = start_near(seen, random, 0.2);
  const PointFit stopped = fit_points(seen.points, start, 1, 1e-9);
  EXPECT_FALSE(stopped.converged);
  EXPECT_LT(stopped.equations.chi2, point_chi2(seen.points, start));
  const PointFit full = fit_points(seen.points, start, 30, 1e-9);
  EXPECT_TRUE(full.converged);
  EXPECT_LE(full.iterations, 30);
}

TEST(VarianceFactor, EnlargesBeyondChanceOnly) {
  EXPECT_EQ(variance_factor(100, 0), 1);
  EXPECT_EQ(variance_factor(5, 10), 1);  // never smaller
  // 99.9 % quantiles from a table: 13.816 (2), 29.588 (10), 149.449 (100)
  for (const auto& [dof, quantile] :
       {std::pair(2, 13.816), std::pair(10, 29.588), std::pair(100, 149.449)}) {
    EXPECT_EQ(variance_factor(0.97 * quantile, dof), 1) << dof;
    EXPECT_DOUBLE_EQ(variance_factor(1.03 * quantile, dof), 1.03 * quantile / dof) << dof;
  }
}

}  // namespace
}  // namespace occ::test
