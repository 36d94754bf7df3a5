// SPDX-License-Identifier: Apache-2.0
// Motion at constant velocity. A velocity is d [rotation, translation] / dt of a pose's left
// perturbation (geometry/rigid.hpp) [rad/s, m/s]; the pose moves on a screw,
//     pose(t) = [exp(w t), J(w t) v t] * pose(0)   with J the left Jacobian of SO(3).
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Pose after `time_s`.
LIBOCC_API Rigid3 moved_pose(const Rigid3& from, const Vector6& velocity, double time_s);

/// Velocity with moved_pose(from, velocity, time_s) == to and a rotation of at most 180 degrees.
/// Throws std::invalid_argument unless time_s > 0.
LIBOCC_API Vector6 velocity_between(const Rigid3& from, const Rigid3& to, double time_s);

}  // namespace occ
