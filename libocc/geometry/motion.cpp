// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/motion.hpp"

#include <Eigen/LU>

#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {

Rigid3 moved_pose(const Rigid3& from, const Vector6& velocity, double time_s) {
  if (velocity.isZero(0) || time_s == 0) return from;
  const Eigen::Vector3d rotation = time_s * velocity.head<3>();
  const Eigen::Vector3d shift = so3_left_jacobian(rotation) * (time_s * velocity.tail<3>());
  return Rigid3{so3_exp(rotation), shift} * from;
}

Vector6 velocity_between(const Rigid3& from, const Rigid3& to, double time_s) {
  require(time_s > 0, "time_s", time_s, "positive");
  const Rigid3 step = to * from.inverse();
  const Eigen::Vector3d rotation = so3_log(step.rotation);
  const Eigen::Matrix3d left = so3_left_jacobian(rotation);
  Vector6 velocity;
  velocity << rotation, left.inverse() * step.translation;
  return velocity / time_s;
}

}  // namespace occ
