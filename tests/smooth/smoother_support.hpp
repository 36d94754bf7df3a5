// SPDX-License-Identifier: Apache-2.0
// Drives for the tests of smoothers: the published set of four lamps, and a vehicle in a room.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/smooth/smoother.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

inline PointSighting sighting(const Camera& camera, const Rigid3& cam_from_world,
                              const Eigen::Vector3d& point, double sigma_px, Random* noise) {
  PointSighting seen;
  seen.point_in_world = point;
  seen.px = camera.project(cam_from_world * point).value();
  if (noise != nullptr) seen.px += sigma_px * Eigen::Vector2d(noise->normal(), noise->normal());
  seen.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  return seen;
}

inline Vector6 random_part(Random& random, double sigma_rad, double sigma_m) {
  Vector6 out;
  out << sigma_rad * random_vector(random), sigma_m * random_vector(random);
  return out;
}

inline Matrix6 part_covariance(double sigma_rad, double sigma_m) {
  Vector6 variances;
  variances << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variances.asDiagonal();
}

struct Drive {
  std::vector<Rigid3> truth;  ///< body_from_world
  SmootherInput input;
};

/// The published set: 80 poses from (10, 50, 0) dm in steps of 1 dm along x, four lamps 50 dm up,
/// pixel sigma 2, odometry 0.2 dm and 2 deg on each axis of each step. The published figures are
/// met when the camera looks straight up, the pose has six degrees of freedom, and all four lamps
/// are seen although 640 x 480 pixels would not hold them.
inline Drive published_drive(std::uint64_t seed, int poses = 80) {
  constexpr double sigma_px = 2, sigma_m = 0.02, sigma_rad = 2 * pi / 180;
  const std::vector<Eigen::Vector3d> lamps = {{2, 8, 5}, {8, 2, 5}, {2, 2, 5}, {8, 8, 5}};
  Random random(seed, 7);
  Drive drive;
  const Camera camera = Camera::pinhole(640, 480, 520.9, 521.0, 325.1, 249.7);
  for (int k = 0; k < poses; ++k) {
    const Rigid3 pose{Eigen::Matrix3d::Identity(), -Eigen::Vector3d(1 + 0.1 * k, 5, 0)};
    SmootherFrame frame;
    frame.time_s = k;
    frame.camera = camera;
    for (const auto& lamp : lamps)
      frame.sightings.push_back(sighting(camera, pose, lamp, sigma_px, &random));
    drive.input.frames.push_back(frame);
    if (k > 0) {
      const Rigid3 step = pose * drive.truth.back().inverse();
      drive.input.odometry.push_back({k - 1.0, k + 0.0,
                                      perturb(step, random_part(random, sigma_rad, sigma_m)),
                                      part_covariance(sigma_rad, sigma_m)});
    }
    drive.truth.push_back(pose);
  }
  return drive;
}

/// Pose of the body of room_drive() after a number of periods.
inline Rigid3 room_pose(double periods) {
  const double angle = 0.15 * periods;
  const Eigen::Vector3d place(2 + 0.4 * std::cos(angle), 2 + 0.3 * std::sin(angle),
                              0.4 + 0.05 * std::sin(3 * angle));
  const Eigen::Matrix3d rotation =
      so3_exp({0.05 * std::sin(angle), 0.04 * std::cos(angle), 0}) * so3_exp({0, 0, -angle});
  return {rotation, -(rotation * place)};
}

/// A body that drives through the room of six lamps with a camera mounted at an angle; without
/// noise when sigma_px is 0 (the sigmas are then those of 0.3 px).
inline Drive room_drive(std::uint64_t seed, int poses, double noise = 1) {
  constexpr double sigma_px = 0.3, sigma_m = 0.005, sigma_rad = 0.004, period_s = 0.1;
  Random random(seed, 3);
  const Scene scene = irregular_room();
  const Rigid3 cam_from_body{so3_exp({0.1, -0.05, 1.2}), {0.05, -0.1, 0.02}};
  Drive drive;
  Random* noisy = noise > 0 ? &random : nullptr;
  for (int k = 0; k < poses; ++k) {
    const Rigid3 pose = room_pose(k);
    SmootherFrame frame;
    frame.time_s = period_s * k;
    frame.camera = scene.camera;
    frame.cam_from_body = cam_from_body;
    for (const Lamp& lamp : scene.lamps)
      frame.sightings.push_back(
          sighting(scene.camera, cam_from_body * pose, lamp.centre_m, sigma_px, noisy));
    drive.input.frames.push_back(frame);
    if (k > 0) {
      const Rigid3 step = pose * drive.truth.back().inverse();
      const Vector6 off = noise * random_part(random, sigma_rad, sigma_m);
      drive.input.odometry.push_back({period_s * (k - 1), period_s * k, perturb(step, off),
                                      part_covariance(sigma_rad, sigma_m)});
    }
    drive.truth.push_back(pose);
  }
  return drive;
}

struct PlanarDrive {
  std::vector<PlanarPose> truth;
  PlanarSmootherInput input;
};

inline PlanarDrive planar_drive(std::uint64_t seed, int poses, double noise = 1) {
  constexpr double sigma_px = 0.3, period_s = 0.1, height_m = 0.2;
  const Eigen::Vector3d sigmas(0.004, 0.002, 0.006);
  Random random(seed, 4);
  const Scene scene = irregular_room();
  // The body's z is up, and so is the camera's.
  const Rigid3 cam_from_body{so3_exp({0.1, 0.05, 0.7}), {0.05, -0.1, 0.02}};
  PlanarDrive drive;
  drive.input.height_m = height_m;
  PlanarPose pose{1.6, 1.7, 0.4};
  for (int k = 0; k < poses; ++k) {
    if (k > 0) {
      const PlanarPose step = arc(0.05, 0.08);
      pose = pose * step;
      const Eigen::Vector3d off = noise * sigmas.cwiseProduct(random_vector(random));
      PlanarOdometry odometry;
      odometry.from_s = period_s * (k - 1);
      odometry.to_s = period_s * k;
      odometry.increment = {step.x_m + off[0], step.y_m + off[1], step.heading_rad + off[2]};
      odometry.covariance = sigmas.cwiseAbs2().asDiagonal();
      drive.input.odometry.push_back(odometry);
    }
    SmootherFrame frame;
    frame.time_s = period_s * k;
    frame.camera = scene.camera;
    frame.cam_from_body = cam_from_body;
    const Rigid3 cam = cam_from_body * body_from_world(pose, height_m);
    for (const Lamp& lamp : scene.lamps)
      frame.sightings.push_back(
          sighting(scene.camera, cam, lamp.centre_m, sigma_px, noise > 0 ? &random : nullptr));
    drive.input.frames.push_back(frame);
    drive.truth.push_back(pose);
  }
  return drive;
}

inline double position_error_m(const Rigid3& a, const Rigid3& b) {
  return (a.origin_in_source() - b.origin_in_source()).norm();
}

}  // namespace occ::test
