// SPDX-License-Identifier: Apache-2.0
// P3P for several assignments in single precision, compared with P3P in double precision.
#include "libocc/identify/internal/lane_p3p.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/core/random.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::core;
using namespace internal::identify;
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Lanes = LanesOf<Simd::baseline>::Type;

Matrix3d random_points(Random& random) {
  Matrix3d points;
  for (int i = 0; i < 9; ++i) points(i % 3, i / 3) = random.normal();
  return points;
}

std::vector<Vector3d> depths_in_lanes(const Matrix3d& bearings, const Matrix3d& points) {
  const auto squared = [](const Matrix3d& m, int i, int j) {
    return static_cast<float>((m.col(i) - m.col(j)).squaredNorm());
  };
  const Chords2 chords{squared(bearings, 0, 1), squared(bearings, 0, 2), squared(bearings, 1, 2)};
  const float s01 = squared(points, 0, 1), s02 = squared(points, 0, 2), s12 = squared(points, 1, 2),
              sum = s01 + s02 + s12;
  LaneDepths<Lanes> roots[4];
  const Lanes zero{};
  solve_depths(chords, LaneSides2<Lanes>{zero + s01 / sum, zero + s02 / sum, zero + s12 / sum},
               roots);
  std::vector<Vector3d> found;
  for (const auto& r : roots)
    if (r.valid[1]) found.push_back(std::sqrt(sum) * Vector3d(r.d0[1], r.d1[1], r.d2[1]));
  return found;
}

// Compares all poses whose points are well in front of the camera.
TEST(LaneP3p, FindsTheSolutionsOfDoublePrecision) {
  Random random(4);
  int solutions = 0, missed = 0;
  for (int i = 0; i < 20000; ++i) {
    const Matrix3d points = random_points(random);
    const Matrix3d in_cam =
        (so3_exp(3 * Vector3d(random.normal(), random.normal(), random.normal())) * points)
            .colwise() +
        Vector3d(random.normal(), random.normal(), 5);
    if (in_cam.row(2).minCoeff() < 0.5) continue;
    const Matrix3d bearings = in_cam.colwise().normalized();
    const std::vector<Vector3d> found = depths_in_lanes(bearings, points);
    for (const Rigid3& pose : p3p(bearings, points)) {
      const Vector3d depths =
          ((pose.rotation * points).colwise() + pose.translation).colwise().norm();
      ++solutions;
      missed += std::none_of(found.begin(), found.end(), [&](const Vector3d& d) {
        return (d - depths).norm() < 1e-3 * depths.norm();
      });
    }
  }
  EXPECT_GT(solutions, 20000);
  EXPECT_LT(missed, 0.002 * solutions) << missed << " of " << solutions;
}

TEST(LaneP3p, SolutionsHaveTheTrianglesSides) {
  Random random(5);
  int found = 0, wrong = 0;
  for (int i = 0; i < 5000; ++i) {
    const Matrix3d points = random_points(random);
    Matrix3d bearings = random_points(random).colwise().normalized();
    bearings.row(2) = bearings.row(2).cwiseAbs();
    for (const Vector3d& d : depths_in_lanes(bearings, points)) {
      ++found;
      const Matrix3d corners = bearings * d.asDiagonal();
      double worst = 0;
      for (int k = 0; k < 3; ++k) {
        const int l = (k + 1) % 3;
        worst = std::max(worst, std::abs((corners.col(k) - corners.col(l)).norm() -
                                         (points.col(k) - points.col(l)).norm()));
      }
      wrong += worst > 0.02 * points.norm();
    }
  }
  EXPECT_GT(found, 2000);
  // Complex pairs near a double root are accepted on purpose.
  EXPECT_LT(wrong, 0.1 * found) << wrong << " of " << found;
}

TEST(LaneNumbers, RootsAndTheirInverses) {
  for (const float x : {1e-20F, 3e-5F, 0.5F, 2.0F, 7e8F}) {
    const Lanes lanes = Lanes{} + x;
    EXPECT_NEAR(inverse_root(lanes)[2] * std::sqrt(x), 1, 1e-6);
    EXPECT_NEAR(root(lanes)[0] / std::sqrt(x), 1, 1e-6);
    EXPECT_NEAR(rough_cube_root(lanes)[3] / std::cbrt(x), 1, 0.06);
  }
  EXPECT_EQ(root(Lanes{} - 1)[0], 0);
  EXPECT_TRUE(std::isfinite(inverse_root(Lanes{})[0]));
}

}  // namespace
}  // namespace occ
