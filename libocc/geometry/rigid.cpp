// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/rigid.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {

Eigen::Matrix4d Rigid3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation;
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Rigid3 Rigid3::from_matrix(const Eigen::Matrix4d& matrix, const char* name) {
  const std::string argument(name);
  require(matrix.allFinite(), argument, matrix, "finite");
  const Eigen::RowVector4d last = matrix.row(3);
  require(last == Eigen::RowVector4d(0, 0, 0, 1), argument + "'s last row", last, "0 0 0 1");
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  const double skewed = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  require(skewed <= 1e-6, argument + "'s rotation", r, "orthonormal to 1e-6");
  require(r.determinant() > 0, argument + "'s rotation", r, "of determinant +1, not a mirror");
  return {r, matrix.topRightCorner<3, 1>()};
}

Rigid3 perturb(const Rigid3& transform, const Vector6& delta) {
  const Eigen::Matrix3d rotation = so3_exp(delta.head<3>());
  return {rotation * transform.rotation, rotation * transform.translation + delta.tail<3>()};
}

Vector6 difference(const Rigid3& to, const Rigid3& from) {
  const Eigen::Matrix3d rotation = to.rotation * from.rotation.transpose();
  Vector6 delta;
  delta << so3_log(rotation), to.translation - rotation * from.translation;
  return delta;
}

Matrix6 adjoint(const Rigid3& a) {
  Matrix6 out = Matrix6::Zero();
  out.topLeftCorner<3, 3>() = out.bottomRightCorner<3, 3>() = a.rotation;
  out.bottomLeftCorner<3, 3>() = skew(a.translation) * a.rotation;
  return out;
}

Eigen::Matrix3d position_covariance(const Rigid3& cam_from_world, const Matrix6& covariance) {
  const Eigen::Matrix3d& r = cam_from_world.rotation;
  return r.transpose() * covariance.bottomRightCorner<3, 3>() * r;
}

// To third order the nonlinear part is (w (w . a) - a |w|^2) / 2 - |w|^2 w x a / 6. The moment of
// the first term follows from Isserlis' theorem for the fourth moments of a Gaussian. That of the
// second is computed as for a single axis w, which is an upper bound.
Eigen::Matrix3d arc_moment(const Eigen::Matrix3d& rotation_covariance, const Eigen::Vector3d& arm) {
  const Eigen::Matrix3d& s = rotation_covariance;
  const Eigen::Vector3d along = s * arm;
  const double trace = s.trace();
  const Eigen::Vector3d mixed = trace * along + 2 * (s * along);
  const Eigen::Matrix3d crossed = mixed * arm.transpose();
  const Eigen::Matrix3d across = skew(arm) * s * skew(arm).transpose();
  const Eigen::Matrix3d moment =
      0.25 * (arm.dot(along) * s + 2 * along * along.transpose() - 2 * crossed +
              (trace * trace + 2 * s.squaredNorm()) * arm * arm.transpose()) +
      15.0 / 36 * trace * trace * across;
  return 0.5 * (moment + moment.transpose());  // crossed is half of a symmetric sum
}

Rigid3 look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
               const Eigen::Vector3d& up) {
  const Eigen::Vector3d view = target - position;
  require(view.allFinite() && view.norm() > 0, "target", target.transpose(),
          "finite and away from position");
  const Eigen::Vector3d z = view.normalized();
  const Eigen::Vector3d right = z.cross(up);
  require(right.norm() > 1e-9 * up.norm(), "up", up.transpose(),
          "a direction other than that of view");
  const Eigen::Vector3d x = right.normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {rotation, -(rotation * position)};
}

double heading_rad(const Rigid3& cam_from_world) {
  const double azimuth = std::atan2(cam_from_world.rotation(0, 1), cam_from_world.rotation(0, 0));
  return azimuth == -std::atan2(0.0, -1.0) ? -azimuth : azimuth;  // atan2 returns both -pi and pi
}

}  // namespace occ
