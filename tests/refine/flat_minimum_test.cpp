// SPDX-License-Identifier: Apache-2.0
// Covariance of a minimum in a flat valley of chi2, near the danger cylinder of three lamps.
#include "libocc/refine/internal/flat_minimum.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <optional>

#include "libocc/geometry/so3.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

/// Three lamps on a circle of 0.8 m, seen from the given distance from the axis of the circle. On
/// the cylinder above the circle two poses meet.
struct NearCylinder {
  Scene scene;
  Rigid3 truth;
  std::vector<Blob> blobs;
  RefineOptions options;
  Observations observations;

  explicit NearCylinder(double distance_m, double sigma_px = 0.05, std::uint64_t noise_seed = 0) {
    scene.camera = test::vga_camera();
    for (const double angle : {0.2, 1.9, 3.6})
      scene.lamps.push_back(test::disc_lamp(static_cast<int>(scene.lamps.size()),
                                            {0.8 * std::cos(angle), 0.8 * std::sin(angle), 2.5},
                                            0.003));
    truth = {so3_exp({0.05, -0.04, 0.3}), Eigen::Vector3d::Zero()};
    truth.translation =
        -(truth.rotation * Eigen::Vector3d(0.3 * distance_m, 0.954 * distance_m, 0));
    test::Measurement m;
    m.centroid_sigma_px = sigma_px;
    blobs = test::exact_blobs(scene, truth, m);
    if (noise_seed > 0) {
      Random random(51, noise_seed);
      for (Blob& blob : blobs) blob.centroid_px += test::noise_2d(random, sigma_px);
    }
    options.rung = Rung::centres;
    observations = observe(test::in_order(scene), blobs, scene, options);
  }

  RefineProblem problem() const { return {observations, scene, options, Rung::centres}; }

  /// The other pose of the three lamps that is nearest to the true one.
  std::optional<Rigid3> other() const {
    Eigen::Matrix3d bearings, points;
    for (int i = 0; i < 3; ++i) {
      bearings.col(i) = scene.camera.unproject(blobs[i].centroid_px).value();
      points.col(i) = scene.lamps[i].centre_m;
    }
    std::optional<Rigid3> nearest;
    double least = 10;
    for (const Rigid3& pose : p3p(bearings, points)) {
      const double apart = difference(pose, truth).norm();
      if (apart < 1e-4 || apart > least) continue;
      least = apart;
      nearest = pose;
    }
    return nearest;
  }
};

/// Distance of a pose from the minimum in standard deviations of these normal equations.
double sigmas_between(const Minimum& minimum, const Matrix8& information, const Rigid3& pose) {
  const Rigid3& from = minimum.state.cam_from_world;
  Vector6 step;
  step.head<3>() = so3_log(pose.rotation * from.rotation.transpose());
  step.tail<3>() = pose.translation - minimum.pivot -
                   so3_exp(step.head<3>()) * (from.translation - minimum.pivot);
  return std::sqrt(step.dot(information.topLeftCorner<6, 6>() * step));
}

TEST(FlatMinimum, ContainsThePoseThatMeetsTheMinimum) {
  for (const double distance : {0.72, 0.74, 0.76, 0.84, 0.86}) {
    const NearCylinder view(distance);
    RefineProblem problem = view.problem();
    const Minimum minimum = minimise(problem, {view.truth}, 30, 1e-5);
    ASSERT_TRUE(minimum.converged);
    EXPECT_TRUE(may_be_flat(minimum));
    const std::optional<Rigid3> other = view.other();
    ASSERT_TRUE(other);
    EXPECT_GT(sigmas_between(minimum, minimum.normal.information, *other), 3);
    Minimum widened = minimum;
    widen_if_flat(problem, widened);
    // The other pose fits as well, so it is within a few standard deviations.
    const double sigmas = sigmas_between(minimum, widened.normal.information, *other);
    EXPECT_LT(sigmas, 3) << distance;
    EXPECT_GT(sigmas, 1) << distance;
    // No direction has more information than before.
    const Vector8 units = units_of(minimum.normal);
    const Matrix8 lost = units.asDiagonal() *
                         (minimum.normal.information - widened.normal.information) *
                         units.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix8> eigen(lost);
    EXPECT_GT(eigen.eigenvalues()[0], -1e-6);
    EXPECT_GT(eigen.eigenvalues()[7], 1e-6);
    EXPECT_GT(widened.bend.trace(), 0);
  }
}

/// Lowest chi2 at this distance along a direction of the pose, by coordinate descent of its own.
double lowest_chi2(RefineProblem& problem, const Minimum& minimum, const Vector6& along,
                   double distance) {
  Vector8 x = Vector8::Zero();
  x.head<6>() = distance * along;
  const Vector8 units = units_of(minimum.normal);
  double best = problem.chi2(moved(minimum.state, minimum.pivot, units.cwiseProduct(x)));
  // Directions across `along`.
  Eigen::Matrix<double, 6, 6> basis = Matrix6::Identity();
  basis.col(0) = along;
  const Matrix6 q = Eigen::HouseholderQR<Matrix6>(basis).householderQ();
  for (double step = 0.5; step > 1e-3; step *= 0.7)
    for (int sweep = 0; sweep < 20; ++sweep)
      for (int k = 1; k < 6; ++k)
        for (const double side : {-step, step}) {
          Vector8 there = x;
          there.head<6>() += side * q.col(k);
          const double chi2 =
              problem.chi2(moved(minimum.state, minimum.pivot, units.cwiseProduct(there)));
          if (chi2 < best) {
            best = chi2;
            x = there;
          }
        }
  return best;
}

TEST(FlatMinimum, StaysAsItIsFarFromTheCylinder) {
  for (const double distance : {0.05, 0.3, 1.4}) {
    const NearCylinder view(distance, 0.02);
    RefineProblem problem = view.problem();
    const Minimum minimum = minimise(problem, {view.truth}, 30, 1e-5);
    ASSERT_TRUE(minimum.converged);
    EXPECT_FALSE(may_be_flat(minimum)) << distance;
    Minimum same = minimum;
    widen_if_flat(problem, same);
    EXPECT_EQ(same.normal.information, minimum.normal.information) << distance;
    EXPECT_TRUE(same.bend.isZero(0));
    // Three sigmas along the weakest direction raise chi2 by nine.
    const Vector8 units = units_of(minimum.normal);
    const Matrix6 scaled = (units.asDiagonal() * minimum.normal.information * units.asDiagonal())
                               .topLeftCorner<6, 6>();
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(scaled);
    const Vector6 along = eigen.eigenvectors().col(0);
    const double sigma = 1 / std::sqrt(eigen.eigenvalues()[0]);
    for (const double side : {-3, 3})
      EXPECT_NEAR(lowest_chi2(problem, minimum, along, side * sigma), 9, 2) << distance;
  }
}

TEST(FlatMinimum, IsRecognisedByTheWidthOfTheRotation) {
  // The arc grows with the square of the standard deviation.
  const auto is_flat = [](double sigma_px) {
    const NearCylinder view(0.3, sigma_px);
    RefineProblem problem = view.problem();
    return may_be_flat(minimise(problem, {view.truth}, 30, 1e-5));
  };
  EXPECT_FALSE(is_flat(0.02));
  EXPECT_TRUE(is_flat(5));
  Minimum undetermined;
  EXPECT_TRUE(may_be_flat(undetermined));
}

}  // namespace
}  // namespace occ
