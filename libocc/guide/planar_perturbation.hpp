// SPDX-License-Identifier: Apache-2.0
// Internal: how a vehicle's pose on the floor moves its pose in space.
#pragma once

#include "libocc/geometry/planar_pose.hpp"

namespace occ {

/// d [rotation, translation] of body_from_world's left perturbation / d [x, y, heading], then by
/// roll, pitch and height in the body's axes: what the floor holds.
inline Matrix6 planar_perturbation(const PlanarPose& pose) {
  Matrix6 jacobian = Matrix6::Zero();
  jacobian(2, 2) = -1;  // the world turns the other way
  jacobian.block<1, 2>(3, 0) = -pose.forward().transpose();
  jacobian.block<1, 2>(4, 0) = -pose.left().transpose();
  jacobian(0, 3) = jacobian(1, 4) = jacobian(5, 5) = 1;
  return jacobian;
}

}  // namespace occ
