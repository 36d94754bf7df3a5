// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/perturbation.hpp"

#include <Eigen/LU>

#include "libocc/geometry/so3.hpp"

namespace occ {

Matrix6 d_difference(const Vector6& delta) {
  Matrix6 out = Matrix6::Identity();
  out.topLeftCorner<3, 3>() = so3_left_jacobian(delta.head<3>()).inverse();
  out.bottomLeftCorner<3, 3>() = -skew(delta.tail<3>());
  return out;
}

Matrix6 planar_perturbation(const PlanarPose& pose) {
  Matrix6 jacobian = Matrix6::Zero();
  jacobian(2, 2) = -1;  // body_from_world rotates against the heading
  jacobian.block<1, 2>(3, 0) = -pose.forward().transpose();
  jacobian.block<1, 2>(4, 0) = -pose.left().transpose();
  jacobian(0, 3) = jacobian(1, 4) = 1;
  jacobian(5, 5) = -1;
  return jacobian;
}

Eigen::Matrix3d planar_covariance(const PlanarPose& pose, const Matrix6& covariance) {
  const Eigen::Matrix<double, 6, 3> along = planar_perturbation(pose).leftCols<3>();
  const Eigen::Matrix3d planar = along.transpose() * covariance * along;
  return 0.5 * (planar + planar.transpose());
}

}  // namespace occ
