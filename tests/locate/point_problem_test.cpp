// SPDX-License-Identifier: Apache-2.0
// The whitened problem of solve_pose(): its chi-square is that of the pixels.
#include "libocc/locate/internal/point_problem.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "tests/support/support.hpp"

namespace occ::internal::locate {
namespace {

/// Points before a camera with their pixels, displaced by about `noise_px`.
struct Pixels {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd px;
  Rigid3 pose;

  Pixels(const Camera& camera, int count, double noise_px) : points(3, count), px(2, count) {
    Random random(4);
    pose = {so3_exp({0.2, -0.1, 0.4}), {0.3, -0.2, 4}};
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d in_cam(random.uniform(-1, 1), random.uniform(-0.7, 0.7),
                                   random.uniform(3, 5));
      points.col(i) = pose.inverse() * in_cam;
      px.col(i) =
          *camera.project(in_cam) + noise_px * Eigen::Vector2d(random.normal(), random.normal());
    }
  }
};

double chi2_of_pixels(const Pixels& seen, const Camera& camera, const Rigid3& pose,
                      const Eigen::VectorXd& sigmas) {
  double chi2 = 0;
  for (Eigen::Index i = 0; i < seen.px.cols(); ++i) {
    const Eigen::Vector2d off =
        *camera.project(pose * Eigen::Vector3d(seen.points.col(i))) - seen.px.col(i);
    chi2 += off.squaredNorm() / std::pow(sigmas[sigmas.size() == 1 ? 0 : i], 2);
  }
  return chi2;
}

TEST(PointProblem, Chi2IsThatOfThePixels) {
  const Camera plain = Camera::pinhole(640, 480, 500, 480, 310, 250);
  const Camera lens = Camera::pinhole(640, 480, 500, 480, 310, 250, {-0.2, 0.05, 1e-3, -1e-3});
  Eigen::VectorXd each(7);
  each << 0.3, 0.5, 1, 0.2, 0.4, 2, 0.7;
  for (const Camera& camera : {plain, lens}) {
    const Pixels seen(camera, 7, 0.5);
    for (const Eigen::VectorXd& sigmas : {Eigen::VectorXd::Constant(1, 0.4).eval(), each}) {
      const PointProblem problem = make_point_problem(seen.points, seen.px, camera, sigmas);
      Vector6 off;
      off << 1e-3, -2e-3, 1e-3, 3e-3, -2e-3, 4e-3;
      const Rigid3 pose = perturb(seen.pose, off);
      const double expected = chi2_of_pixels(seen, camera, pose, sigmas);
      const double found = pose::point_chi2(problem.seen, problem.frame.normalised(pose));
      // A distorted image is flat to first order only.
      EXPECT_NEAR(found, expected, (camera.distortion().empty() ? 1e-9 : 0.02) * expected);
      for (int i = 0; i < 7; ++i) {
        const Eigen::Vector3d bearing = *camera.unproject(seen.px.col(i));
        EXPECT_LT((problem.bearings.col(i) - bearing).norm(), 1e-9) << i;
      }
    }
  }
}

TEST(PointProblem, APixelOutsideTheLensIsNamed) {
  const Camera fisheye = Camera::pinhole(640, 480, 200, 200, 320, 240, {-0.5, 0, 0, 0});
  const Camera plain = Camera::pinhole(640, 480, 200, 200, 320, 240);
  Pixels seen(plain, 4, 0);
  seen.px.col(2) = Eigen::Vector2d(4000, 3000);
  const std::string text = test::complaint(
      [&] { make_point_problem(seen.points, seen.px, fisheye, Eigen::VectorXd::Constant(1, 1)); });
  EXPECT_NE(text.find("points_px[2]"), std::string::npos) << text;
}

}  // namespace
}  // namespace occ::internal::locate
