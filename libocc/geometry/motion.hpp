// SPDX-License-Identifier: Apache-2.0
// Motion at constant velocity: d [rotation, translation] / dt of a pose's left perturbation
// [rad/s, m/s], which moves it on a screw.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Where a pose has got to after a time.
LIBOCC_API Rigid3 moved_pose(const Rigid3& from, const Vector6& velocity, double time_s);

/// The velocity with moved_pose(from, velocity, time_s) == to that turns by no more than half a
/// turn.
LIBOCC_API Vector6 velocity_between(const Rigid3& from, const Rigid3& to, double time_s);

}  // namespace occ
