// SPDX-License-Identifier: Apache-2.0
// Checks of lamps of any flat shape.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "libocc/formation/rim.hpp"
#include "libocc/locate/locate.hpp"
#include "tests/support/simulate_support.hpp"

namespace occ::test {

/// Centroid of the area of a finely sampled polygon.
inline Eigen::Vector2d polygon_centroid(const std::vector<Eigen::Vector2d>& p) {
  double area = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Eigen::Vector2d a = p[i] - p[0], b = p[(i + 1) % p.size()] - p[0];
    const double swept = a.x() * b.y() - a.y() * b.x();
    area += swept / 2;
    moment += swept / 6 * (a + b);
  }
  return p[0] + moment / area;
}

/// Compares the centre of a lamp's image with the centroid of its sampled rim, and the Jacobian
/// with differences.
inline void expect_true_centre(const Lamp& lamp, const Rigid3& pose, const Camera& camera) {
  Eigen::Matrix<double, 2, 6> jacobian;
  const auto centre = project_lamp_centre(lamp, pose, camera, &jacobian);
  ASSERT_TRUE(centre);
  EXPECT_LT((*centre - polygon_centroid(*project_rim(lamp, pose, camera, 8000))).norm(), 3e-4);
  const auto f = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return *project_lamp_centre(lamp, perturb(pose, Vector6(d)), camera);
  };
  const auto numeric = numerical_jacobian(f, Eigen::VectorXd::Zero(6));
  EXPECT_TRUE(jacobian_agrees(jacobian, numeric, 1e-5));
  EXPECT_FALSE(jacobian_agrees(1.001 * jacobian, numeric, 1e-5));
}

/// Locates eight views of a scene of six lamps, with true covariances.
inline void expect_located_by_rims(const Scene& scene) {
  constexpr int views = 8;
  double nees = 0;
  for (std::uint64_t seed = 0; seed < views; ++seed) {
    const Rigid3 pose = look_at({1.7 + 0.05 * static_cast<double>(seed), 2.1, 0.5}, {1.9, 2.1, 3},
                                Eigen::Vector3d::UnitY());
    SimulateOptions options;
    options.seed = seed;
    const Rendered rendered = simulate(scene, pose, options);
    const Result<Fix> fix = locate(rendered.image.view(), scene);
    ASSERT_EQ(fix.status, Status::ok) << fix.message;
    EXPECT_EQ(fix->lamps.size(), 6u);
    const Eigen::Vector3d error = fix->position_m - pose.origin_in_source();
    EXPECT_LT(error.norm(), 1e-3);
    nees += error.dot(fix->position_covariance_m2.inverse() * error) / 3 / views;
  }
  EXPECT_LT(nees, 1.9);  // chi-square of 24 degrees of freedom, one in a thousand
  EXPECT_GT(nees, 0.35);
}

}  // namespace occ::test
