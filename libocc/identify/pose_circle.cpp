// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/pose_circle.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/rim_errors.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/internal/circle_of_disc.hpp"

namespace occ {

Rigid3 PoseCircle::at(double angle_rad) const {
  const Eigen::Matrix3d turn = so3_exp(-angle_rad * axis);  // of the world, about the centre
  return {cam_from_world.rotation * turn,
          cam_from_world.translation + cam_from_world.rotation * (centre_m - turn * centre_m)};
}

namespace internal::identify {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double min_common_px = 1e-3;  // for a covariance that is not singular

/// Normal equations of the rim's distances over the left perturbation of a pose.
struct RimSums {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
};

/// The errors that all points of the rim share, and that of the lamp's size, are eliminated.
RimSums rim_sums(const Lamp& disc, const Rigid3& pose, const Blob& blob, const Camera& camera) {
  constexpr double step = 1e-5;  // of the logarithm of the size
  constexpr double min_size_sigma = 1e-9;
  Lamp larger = disc;
  larger.radius_m *= 1 + step;
  RimSums sums;
  Matrix6 of_common = Matrix6::Zero(), mixed = Matrix6::Zero();
  Vector6 common_gradient = Vector6::Zero();
  for (const RimPoint& point : blob.rim) {
    const auto ray = rim_ray(point, camera);
    if (!ray) continue;
    Eigen::Matrix<double, 1, 6> row;
    const auto residual = rim_distance_px(disc, pose, *ray, &row);
    const auto moved = rim_distance_px(larger, pose, *ray);
    if (!residual || !moved) continue;
    Vector6 common;  // errors of Blob::rim_covariance_px2, then the size
    common << core::common_rim_errors(point.normal), (*moved - *residual) / step;
    const double weight = 1 / square(point.sigma_px);
    sums.information += weight * row.transpose() * row;
    sums.gradient += weight * *residual * row.transpose();
    of_common += weight * common * common.transpose();
    mixed += weight * row.transpose() * common.transpose();
    common_gradient += weight * *residual * common;
  }
  Matrix6 covariance = square(min_common_px) * Matrix6::Identity();
  covariance.topLeftCorner<5, 5>() += blob.rim_covariance_px2;
  covariance(5, 5) = square(std::max(min_size_sigma, disc.size_sigma));
  const Matrix6 gain = mixed * core::inverse(Matrix6(of_common + core::inverse(covariance)));
  sums.information -= gain * mixed.transpose();
  sums.gradient -= gain * common_gradient;
  return sums;
}

}  // namespace

PoseCircle circle_of_disc(const Rigid3& start, const Lamp& disc, const Blob& blob,
                          const Camera& camera) {
  constexpr int steps = 4;  // Gauss-Newton, from a pose that fits within a tenth of a pixel
  PoseCircle circle;
  circle.cam_from_world = start;
  circle.axis = disc.normal;
  Matrix6 covariance = Matrix6::Zero();
  for (int i = 0; i <= steps; ++i) {
    const RimSums sums = rim_sums(disc, circle.cam_from_world, blob, camera);
    circle.information = sums.information;
    // Left perturbation of a turn about the disc's axis, which the rim does not determine.
    const Vector3d axis = circle.cam_from_world.rotation * disc.normal;
    Vector6 turn;
    turn << axis, -axis.cross(circle.cam_from_world * disc.centre_m);
    turn.normalize();
    covariance = core::inverse(Matrix6(sums.information + turn * turn.transpose()));
    if (i < steps)
      circle.cam_from_world = perturb(circle.cam_from_world, Vector6(-covariance * sums.gradient));
  }
  const Vector3d place = circle.cam_from_world.origin_in_source();
  circle.height_m = disc.normal.dot(place - disc.centre_m);
  circle.centre_m = disc.centre_m + circle.height_m * disc.normal;
  circle.radius_m = (place - circle.centre_m).norm();
  const Matrix3d of_place = position_covariance(circle.cam_from_world, covariance);
  const Vector3d outwards = (place - circle.centre_m) / std::max(1e-12, circle.radius_m);
  circle.radius_sigma_m = std::sqrt(std::max(0.0, outwards.dot(of_place * outwards)));
  circle.height_sigma_m = std::sqrt(std::max(0.0, disc.normal.dot(of_place * disc.normal)));
  return circle;
}

}  // namespace internal::identify
}  // namespace occ
