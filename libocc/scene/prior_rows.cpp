// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/scene/prior.hpp"

namespace occ {
namespace {

using Row = Eigen::Matrix<double, 1, 6>;

class RowList {
 public:
  void add(double residual, const Row& row) {
    rows_.residuals.conservativeResize(rows_.residuals.size() + 1);
    rows_.jacobian.conservativeResize(rows_.residuals.size(), Eigen::NoChange);
    rows_.residuals[rows_.residuals.size() - 1] = residual;
    rows_.jacobian.bottomRows<1>() = row;
  }

  /// The camera's position C = -R^T t moves by -R^T (translation).
  void add_coordinate(int axis, double off_m, double sigma_m, const Rigid3& cam_from_world) {
    Row row = Row::Zero();
    row.tail<3>() = -cam_from_world.rotation.col(axis).transpose() / sigma_m;
    add(off_m / sigma_m, row);
  }

  /// A rotation vector and its derivative with respect to the rotation of the perturbation.
  void add_rotation(const Eigen::Vector3d& vector, const Eigen::Matrix3d& derivative,
                    double sigma_rad) {
    for (int i = 0; i < 3; ++i) {
      Row row = Row::Zero();
      row.head<3>() = derivative.row(i) / sigma_rad;
      add(vector[i] / sigma_rad, row);
    }
  }

  const PriorRows& rows() const { return rows_; }

 private:
  PriorRows rows_;
};

void add_position(const Prior& prior, const Rigid3& cam_from_world, RowList& list) {
  const Eigen::Vector3d sigmas_m = prior.position_sigmas();
  const Eigen::Vector3d off_m = cam_from_world.origin_in_source() - *prior.position_m;
  for (int i = 0; i < 3; ++i) list.add_coordinate(i, off_m[i], sigmas_m[i], cam_from_world);
}

/// The camera's x axis e is R^T e in the world. It moves by R^T (e x w) for a rotation w of the
/// perturbation.
void add_heading(const Prior& prior, const Rigid3& cam_from_world, RowList& list) {
  const Eigen::Matrix3d& r = cam_from_world.rotation;
  const double difference = heading_rad(cam_from_world) - *prior.heading_rad;
  const double level_squared = r(0, 0) * r(0, 0) + r(0, 1) * r(0, 1);
  Row row = Row::Zero();
  if (level_squared > 0) {
    const Eigen::Vector3d azimuth_gradient =
        (r(0, 0) * r.col(1) - r(0, 1) * r.col(0)) / level_squared;
    row.head<3>() =
        azimuth_gradient.cross(Eigen::Vector3d::UnitX()).transpose() / prior.heading_sigma_rad;
  }
  list.add(std::atan2(std::sin(difference), std::cos(difference)) / prior.heading_sigma_rad, row);
}

/// The rotation vector from the measured direction m to the predicted one, p = R (0, 0, -1), is
/// a theta / sin(theta) with a = m x p.
void add_gravity(const Prior& prior, const Rigid3& cam_from_world, RowList& list) {
  const Eigen::Vector3d m = prior.gravity_in_cam->normalized();
  const Eigen::Vector3d p = -cam_from_world.rotation.col(2);
  const Eigen::Vector3d a = m.cross(p);
  const double sine = a.norm(), cosine = m.dot(p);
  const double angle = std::atan2(sine, cosine);
  if (sine < 1e-12 && cosine < 0) {  // opposite directions: any horizontal axis
    const Eigen::Vector3d axis = m.unitOrthogonal();
    list.add_rotation(angle * axis, axis * axis.transpose(), prior.gravity_sigma_rad);
    return;
  }
  const bool small = sine < 1e-4 && cosine > 0;
  const double ratio = small ? 1 + sine * sine / 6 : angle / std::max(sine, 1e-12);
  const double bend =
      small ? 1.0 / 3 : (sine - angle * cosine) / std::pow(std::max(sine, 1e-12), 3);
  const Eigen::Matrix3d d_a = cosine * Eigen::Matrix3d::Identity() - p * m.transpose();
  const Eigen::Matrix3d d_vector = ratio * d_a + bend * a * a.transpose();
  list.add_rotation(ratio * a, d_vector, prior.gravity_sigma_rad);
}

/// With delta = difference(pose, last), a perturbation changes the rotation vector w of delta by
/// J(w)^-1 (rotation), and its translation d by rotation x d + translation.
void add_last_pose(const PriorPose& last, const Rigid3& cam_from_world, RowList& list) {
  const Vector6 delta = difference(cam_from_world, last.cam_from_world);
  const internal::core::Cholesky<Matrix6> root(last.covariance);
  const Matrix6 jacobian = root.solve_lower(d_difference(delta));
  const Vector6 residual = root.solve_lower(delta);
  for (int i = 0; i < 6; ++i) list.add(residual[i], jacobian.row(i));
}

}  // namespace

PriorRows Prior::rows(const Rigid3& cam_from_world) const {
  RowList list;
  if (position_m) add_position(*this, cam_from_world, list);
  if (height_m)
    list.add_coordinate(2, cam_from_world.origin_in_source().z() - *height_m, height_sigma_m,
                        cam_from_world);
  if (heading_rad) add_heading(*this, cam_from_world, list);
  if (gravity_in_cam) add_gravity(*this, cam_from_world, list);
  if (last_pose) add_last_pose(*last_pose, cam_from_world, list);
  return list.rows();
}

}  // namespace occ
