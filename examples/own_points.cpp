// SPDX-License-Identifier: Apache-2.0
// Pose from points that another program has detected and identified, with a fisheye camera, by each
// solver that accepts them. The pixels are simulated: exact projections plus noise of 0.1 px.
#include <cmath>
#include <iostream>
#include <random>

#include "libocc/camera/camera.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/solver.hpp"

int main() {
  // Image size, focal lengths and principal point in px, coefficients of the equidistant model.
  const occ::Camera camera =
      occ::Camera::fisheye(800, 600, 300, 300, 399.5, 299.5, {0.02, -0.01, 0.003, 0});
  Eigen::Matrix3Xd points(3, 6);           // columns, in metres in the world
  points << 0.5, 3.5, 1.0, 2.8, 2.0, 1.4,  //
      0.4, 0.9, 3.1, 2.6, 1.8, 2.2,        //
      3.0, 3.0, 2.7, 3.0, 2.9, 2.5;
  const Eigen::Vector3d position_m(1.9, 2.1, 0.4);
  const occ::Rigid3 truth = occ::look_at(position_m, {2.1, 2.2, 3}, {0, 1, 0});

  std::mt19937 random(1);
  std::normal_distribution<double> noise_px(0, 0.1);
  Eigen::Matrix2Xd pixels(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    pixels.col(i) = *camera.project(truth * points.col(i).eval()) +
                    Eigen::Vector2d(noise_px(random), noise_px(random));

  for (const char* solver : {"auto", "sqpnp", "epnp", "upnp", "dlt"}) {
    occ::SolvePoseOptions options;
    options.solver = solver;  // the start value; the most likely pose is then found from it
    options.sigma_px = 0.1;
    const occ::Result<occ::Fix> fix = occ::solve_pose(points, pixels, camera, options);
    const double error_m = (fix->position_m - position_m).norm();
    const double sigma_m = std::sqrt(fix->position_covariance_m2.trace());
    std::cout << solver << ": " << to_string(fix.status) << ", error " << 1e3 * error_m
              << " mm, standard deviation " << 1e3 * sigma_m << " mm\n";
    if (!fix.ok() || error_m > 4 * sigma_m) return 1;
  }
}
