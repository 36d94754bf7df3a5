// SPDX-License-Identifier: Apache-2.0
// As Eigen::Quaterniond::FromTwoVectors, whose decomposition for opposite directions takes GCC nine
// seconds to compile.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace occ::internal::geometry {

/// The rotation by the smallest angle that turns the direction `from` into the direction `to`; of
/// opposite directions, one of them.
inline Eigen::Quaterniond shortest_quaternion(const Eigen::Vector3d& from,
                                              const Eigen::Vector3d& to) {
  constexpr double opposite = 1e-12;  // 1 + cos t, rounded
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = a.dot(b);
  Eigen::Quaterniond q;
  if (1 + cosine >
      opposite) {  // half angles: sin t = 2 sin(t/2) cos(t/2), 1 + cos t = 2 cos^2(t/2)
    const double root = std::sqrt((1 + cosine) * 2);
    q.vec() = a.cross(b) * (1 / root);
    q.w() = 0.5 * root;
  } else {
    q.vec() = a.unitOrthogonal();
    q.w() = 0;
  }
  return q;
}

}  // namespace occ::internal::geometry
