// SPDX-License-Identifier: Apache-2.0
// Points in an image whose pose is known, for the tests of solve_pose.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

#include "libocc/locate/solve_pose.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/solver_problems.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

inline Camera plain_camera() { return Camera::pinhole(1280, 960, 800, 800, 639.5, 479.5); }

struct SeenScene {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd pixels;  ///< exact
  Camera camera = plain_camera();
  Rigid3 truth;
};

/// Eight coefficients and skew.
inline Camera bent_camera() {
  return Camera::pinhole(1280, 960, 810, 790, 630, 485,
                         {-0.28, 0.12, 1e-3, -8e-4, -0.02, 0.03, -0.01, 2e-3}, 1.5);
}

/// Projects; false when a point is outside the image by more than half its size.
inline bool see(SeenScene& scene) {
  scene.pixels.resize(2, scene.points.cols());
  const Eigen::Vector2d half(0.5 * scene.camera.width(), 0.5 * scene.camera.height());
  for (Eigen::Index i = 0; i < scene.points.cols(); ++i) {
    const auto pixel = scene.camera.project(scene.truth * Eigen::Vector3d(scene.points.col(i)));
    if (!pixel || ((*pixel - half).cwiseAbs() - 2 * half).maxCoeff() > 0) return false;
    scene.pixels.col(i) = *pixel;
  }
  return true;
}

inline SeenScene random_scene(Random& random, int count, bool flat, const Camera& camera,
                              double nearest = 2.5, double farthest = 6) {
  SeenScene scene;
  scene.camera = camera;
  do {
    scene.points = random_points(random, count, flat);
    scene.truth.rotation = random_rotation(random);
    const double distance = random.uniform(nearest, farthest);
    scene.truth.translation << random.uniform(-0.3, 0.3) * distance,
        random.uniform(-0.2, 0.2) * distance, distance;
  } while (!see(scene));
  return scene;
}

/// Four lamps at the corners of a square in the ceiling, a camera 1 to 4 m below, tilted.
inline SeenScene square_scene(Random& random, double tilt_rad, double min_half_m = 0.3,
                              double max_half_m = 1) {
  SeenScene scene;
  scene.camera = plain_camera();
  scene.points.resize(3, 4);
  do {
    const double half = random.uniform(min_half_m, max_half_m);
    scene.points << -half, half, half, -half, -half, -half, half, half, 3, 3, 3, 3;
    const double tilt = random.uniform(0, tilt_rad), towards = random.uniform(-3.1416, 3.1416);
    const Eigen::Vector3d position(random.uniform(-1, 1), random.uniform(-1, 1),
                                   3 - random.uniform(1, 4));
    scene.truth.rotation = so3_exp({tilt * std::cos(towards), tilt * std::sin(towards), 0}) *
                           so3_exp({0, 0, random.uniform(-3.1416, 3.1416)});
    scene.truth.translation = -(scene.truth.rotation * position);
  } while (!see(scene));
  return scene;
}

inline Eigen::Matrix2Xd noisy_pixels(const SeenScene& scene, double sigma_px, Random& random) {
  Eigen::Matrix2Xd pixels = scene.pixels;
  for (Eigen::Index i = 0; i < pixels.size(); ++i) pixels(i) += sigma_px * random.normal();
  return pixels;
}

inline std::vector<Eigen::Vector3d> columns_of(const Eigen::Matrix3Xd& points) {
  std::vector<Eigen::Vector3d> list;
  for (Eigen::Index i = 0; i < points.cols(); ++i) list.push_back(points.col(i));
  return list;
}

inline std::vector<Rigid3> poses_of(const Fix& fix) {
  std::vector<Rigid3> poses;
  for (const Candidate& c : fix.candidates) poses.push_back(c.cam_from_world);
  return poses;
}

/// Squared length of a candidate's error in its own sigmas; the turn is taken about the points, for
/// about a camera far away it is not linear.
inline double squared_error(const Candidate& c, const SeenScene& scene) {
  const Eigen::Vector3d centroid = scene.points.rowwise().mean();
  const Eigen::Vector3d seen = c.cam_from_world * centroid;
  Vector6 error;
  error.head<3>() = so3_log(scene.truth.rotation * c.cam_from_world.rotation.transpose());
  error.tail<3>() = scene.truth * centroid - seen - error.head<3>().cross(seen);
  return test::nees(error, c.covariance);
}

inline double min_squared_error(const Fix& fix, const SeenScene& scene) {
  double least = std::numeric_limits<double>::infinity();
  for (const Candidate& c : fix.candidates) least = std::min(least, squared_error(c, scene));
  return least;
}

}  // namespace occ::test
