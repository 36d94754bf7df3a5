// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/prior_rows.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace occ {
namespace {

/// The camera's position C = -R^T t moves by -R^T (translation).
void add_coordinate(int axis, double off_m, double sigma_m, const Rigid3& cam_from_world,
                    const Eigen::Vector3d& pivot, Normal& normal) {
  Vector8 row = Vector8::Zero();
  row.segment<3>(3) = -cam_from_world.rotation.col(axis) / sigma_m;
  centre_row(row, pivot);
  normal.add(row, off_m / sigma_m);
}

void add_position(const Prior& prior, const Rigid3& cam_from_world, const Eigen::Vector3d& pivot,
                  Normal& normal) {
  const Eigen::Vector3d sigmas_m = prior.position_sigmas();
  const Eigen::Vector3d off_m = cam_from_world.origin_in_source() - *prior.position_m;
  for (int i = 0; i < 3; ++i)
    add_coordinate(i, off_m[i], sigmas_m[i], cam_from_world, pivot, normal);
}

/// The camera's x axis in the world, R^T e, moves by R^T (e x w): a turn w about it changes
/// nothing.
void add_heading(const Prior& prior, const Rigid3& cam_from_world, Normal& normal) {
  const Eigen::Matrix3d& r = cam_from_world.rotation;
  const double turn = heading_rad(cam_from_world) - *prior.heading_rad;
  const double level_squared = r(0, 0) * r(0, 0) + r(0, 1) * r(0, 1);
  Vector8 row = Vector8::Zero();
  if (level_squared > 0) {
    const Eigen::Vector3d azimuth_gradient =
        (r(0, 0) * r.col(1) - r(0, 1) * r.col(0)) / level_squared;
    row.head<3>() = azimuth_gradient.cross(Eigen::Vector3d::UnitX()) / prior.heading_sigma_rad;
  }
  normal.add(row, std::atan2(std::sin(turn), std::cos(turn)) / prior.heading_sigma_rad);
}

/// The rotation vector that takes the measured direction m to the predicted p = R (0, 0, -1):
/// a theta / sin(theta) with a = m x p.
void add_gravity(const Prior& prior, const Rigid3& cam_from_world, Normal& normal) {
  const Eigen::Vector3d m = prior.gravity_in_cam->normalized();
  const Eigen::Vector3d p = -cam_from_world.rotation.col(2);
  const Eigen::Vector3d a = m.cross(p);
  const double sine = a.norm(), cosine = m.dot(p);
  const double angle = std::atan2(sine, cosine);
  const bool small = sine < 1e-4 && cosine > 0;
  const double ratio = small ? 1 + sine * sine / 6 : angle / std::max(sine, 1e-12);
  const double bend =
      small ? 1.0 / 3 : (sine - angle * cosine) / std::pow(std::max(sine, 1e-12), 3);
  const Eigen::Matrix3d d_a = cosine * Eigen::Matrix3d::Identity() - p * m.transpose();
  const Eigen::Matrix3d d_vector = ratio * d_a + bend * a * a.transpose();
  for (int i = 0; i < 3; ++i) {
    Vector8 row = Vector8::Zero();
    row.head<3>() = d_vector.row(i).transpose() / prior.gravity_sigma_rad;
    normal.add(row, ratio * a[i] / prior.gravity_sigma_rad);
  }
}

/// delta = difference(pose, last): its rotation vector w moves by J(w)^-1 (rotation), its
/// translation d by rotation x d + translation.
void add_last_pose(const PriorPose& last, const Rigid3& cam_from_world,
                   const Eigen::Vector3d& pivot, Normal& normal) {
  const Vector6 delta = difference(cam_from_world, last.cam_from_world);
  Matrix6 jacobian = Matrix6::Identity();
  jacobian.topLeftCorner<3, 3>() = so3_left_jacobian(delta.head<3>()).inverse();
  jacobian.bottomLeftCorner<3, 3>() = -skew(delta.tail<3>());
  const Eigen::LLT<Matrix6> root(last.covariance);
  root.matrixL().solveInPlace(jacobian);
  const Vector6 residual = root.matrixL().solve(delta);
  for (int i = 0; i < 6; ++i) {
    Vector8 row = Vector8::Zero();
    row.head<6>() = jacobian.row(i).transpose();
    centre_row(row, pivot);
    normal.add(row, residual[i]);
  }
}

}  // namespace

void add_prior(const Prior& prior, const Rigid3& cam_from_world, const Eigen::Vector3d& pivot,
               Normal& normal) {
  if (prior.position_m) add_position(prior, cam_from_world, pivot, normal);
  if (prior.height_m)
    add_coordinate(2, cam_from_world.origin_in_source().z() - *prior.height_m, prior.height_sigma_m,
                   cam_from_world, pivot, normal);
  if (prior.heading_rad) add_heading(prior, cam_from_world, normal);
  if (prior.gravity_in_cam) add_gravity(prior, cam_from_world, normal);
  if (prior.last_pose) add_last_pose(*prior.last_pose, cam_from_world, pivot, normal);
}

}  // namespace occ
