// SPDX-License-Identifier: Apache-2.0
// A fixed rotation without any symmetry. Elimination templates divide by entries that vanish when
// rotations are about a coordinate axis or points lie along one; in a world turned by it they do
// not.
#pragma once

#include <Eigen/Geometry>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

inline Eigen::Matrix3d generic_rotation() {
  return Eigen::Quaterniond(0.5377, 0.2931, -0.6453, 0.4549).normalized().toRotationMatrix();
}

}  // namespace occ::internal::pose
