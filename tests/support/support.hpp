// SPDX-License-Identifier: Apache-2.0
// Helpers of the C++ tests: numerical Jacobians, random poses, a room, chi-square intervals.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::test {

/// A pinhole camera of 640 x 480 pixels without distortion.
inline Camera vga_camera() { return Camera::pinhole(640, 480, 500, 500, 319.5, 239.5); }

/// Central differences of f at x, with a step for each argument.
inline Eigen::MatrixXd numerical_jacobian(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& x,
    double step = 1e-6) {
  const Eigen::Index rows = f(x).size();
  Eigen::MatrixXd jacobian(rows, x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::VectorXd above = x, below = x;
    const double h = step * std::max(1.0, std::abs(x[i]));
    above[i] += h;
    below[i] -= h;
    jacobian.col(i) = (f(above) - f(below)) / (above[i] - below[i]);
  }
  return jacobian;
}

/// Returns true if an analytic Jacobian agrees with central differences, relative to its largest
/// entry.
inline ::testing::AssertionResult jacobian_agrees(const Eigen::MatrixXd& analytic,
                                                  const Eigen::MatrixXd& numeric,
                                                  double relative = 1e-6) {
  const double scale = std::max(1e-12, numeric.cwiseAbs().maxCoeff());
  const double worst = (analytic - numeric).cwiseAbs().maxCoeff() / scale;
  if (worst <= relative) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "relative difference " << worst << "\nanalytic\n"
                                       << analytic << "\nnumeric\n"
                                       << numeric;
}

/// Returns the message of the Error that `call` throws; empty if it does not throw.
template <typename Error = std::invalid_argument>
std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

inline Eigen::Vector3d random_vector(Random& random) {
  return {random.normal(), random.normal(), random.normal()};
}

inline Rigid3 random_pose(Random& random, double translation_scale = 2) {
  return {so3_exp(random_vector(random)), translation_scale * random_vector(random)};
}

inline Lamp disc_lamp(int id, const Eigen::Vector3d& centre_m, double radius_m = 0.085) {
  Lamp lamp;
  lamp.id = id;
  lamp.centre_m = centre_m;
  lamp.radius_m = radius_m;
  lamp.power_w = 1.5;
  return lamp;
}

/// Lamps at these places on a ceiling, with ids in their order; 640 x 480, f = 420 px. `lamp`: what
/// is common to all.
inline Scene ceiling_of(const std::vector<Eigen::Vector2d>& places_m, double height_m, Lamp lamp) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  for (const Eigen::Vector2d& place_m : places_m) {
    lamp.id = static_cast<int>(scene.lamps.size());
    lamp.centre_m << place_m, height_m;
    scene.lamps.push_back(lamp);
  }
  scene.validate();
  return scene;
}

/// Six such lamps around the origin, 2.6 m high, for the cameras of upward_view().
inline Scene ceiling_of_six(const Lamp& lamp) {
  return ceiling_of({{-1.1, -0.7}, {0.1, -0.9}, {1.2, -0.6}, {-1, 0.8}, {0, 0.6}, {1.1, 0.9}}, 2.6,
                    lamp);
}

/// Random pose of a camera near the origin that looks up, tilted by up to tilt_rad about each axis.
inline Rigid3 upward_view(Random& random, double min_height_m, double tilt_rad) {
  const Eigen::Vector3d position_m(random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4),
                                   random.uniform(min_height_m, 0.9));
  Rigid3 pose;
  pose.rotation = so3_exp({random.uniform(-tilt_rad, tilt_rad), random.uniform(-tilt_rad, tilt_rad),
                           random.uniform(-pi, pi)});
  pose.translation = -(pose.rotation * position_m);
  return pose;
}

/// Six ceiling lamps that no rotation or mirror maps onto themselves, in a room of 4 x 4 x 3 m; 640
/// x 480, f = 3 mm.
inline Scene irregular_room() {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  scene.lamps = {disc_lamp(0, {0.9, 1.0, 3}),   disc_lamp(1, {3.1, 1.2, 3}),
                 disc_lamp(2, {1.2, 3.2, 3}),   disc_lamp(3, {2.8, 2.7, 3}),
                 disc_lamp(4, {2.05, 1.85, 3}), disc_lamp(5, {1.5, 2.3, 2.6})};
  return scene;
}

/// Four ceiling lamps at the corners of a square: four poses fit any image of them.
inline Scene square_room() {
  Scene scene = irregular_room();
  scene.lamps = {disc_lamp(0, {1, 1, 3}), disc_lamp(1, {3, 1, 3}), disc_lamp(2, {1, 3, 3}),
                 disc_lamp(3, {3, 3, 3})};
  return scene;
}

/// Random pose of a camera near the floor that looks up, tilted by up to tilt_rad.
inline Rigid3 random_room_pose(Random& random, double tilt_rad = 0.25) {
  const Eigen::Vector3d position(random.uniform(1.5, 2.5), random.uniform(1.5, 2.5),
                                 random.uniform(0.2, 0.8));
  const Eigen::Matrix3d rotation =
      so3_exp(tilt_rad * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 0)) *
      so3_exp(Eigen::Vector3d(0, 0, random.uniform(-3.14159, 3.14159)));
  return {rotation, -(rotation * position)};
}

/// Interval that contains a chi-square variable of `dof` degrees with the given z (2.576 for 99 %),
/// by the Wilson-Hilferty cube-root approximation; good to 1 % for dof >= 3.
inline std::pair<double, double> chi2_interval(double dof, double z = 2.5758) {
  const double a = 2.0 / (9.0 * dof);
  const auto at = [&](double s) { return dof * std::pow(1 - a + s * std::sqrt(a), 3); };
  return {at(-z), at(z)};
}

}  // namespace occ::test
