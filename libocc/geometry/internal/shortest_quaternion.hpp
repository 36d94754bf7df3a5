// SPDX-License-Identifier: Apache-2.0
// As Eigen::Quaterniond::FromTwoVectors, whose decomposition for opposite directions takes GCC nine
// seconds to compile; exact for almost opposite ones, too.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace occ::internal::geometry {

/// The rotation by the smallest angle that turns the direction `from` into the direction `to`; of
/// opposite directions, one of them.
inline Eigen::Quaterniond shortest_quaternion(const Eigen::Vector3d& from,
                                              const Eigen::Vector3d& to) {
  constexpr double almost_opposite = 1e-4, opposite = 1e-14;
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const Eigen::Vector3d axis = a.cross(b);
  const double cosine = a.dot(b);
  Eigen::Quaterniond q;
  if (1 + cosine > almost_opposite) {  // sin t = 2 sin(t/2) cos(t/2), 1 + cos t = 2 cos^2(t/2)
    const double root = std::sqrt((1 + cosine) * 2);
    q.vec() = axis * (1 / root);
    q.w() = 0.5 * root;
  } else {  // |a - b| = 2 sin(t/2), |a + b| = 2 cos(t/2)
    const bool has_axis = axis.norm() > opposite;
    q.vec() = 0.5 * (a - b).norm() * (has_axis ? axis.normalized() : a.unitOrthogonal());
    q.w() = 0.5 * (a + b).norm();
  }
  return q;
}

}  // namespace occ::internal::geometry
