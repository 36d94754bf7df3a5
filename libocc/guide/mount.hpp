// SPDX-License-Identifier: Apache-2.0
// How a camera stands on a vehicle. With pan and tilt 0 it looks straight up and its image's x runs
// forward; pan turns it about the vertical, left positive, then tilt bends its view from the
// vertical towards where pan points: the view is (sin tilt cos pan, sin tilt sin pan, cos tilt).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// cam_from_body; `place_m`: of the camera in the body's frame, whose origin is on the floor.
/// Throws std::invalid_argument for what is not finite.
LIBOCC_API Rigid3 camera_on_vehicle(const Eigen::Vector3d& place_m, double pan_rad = 0,
                                    double tilt_rad = 0);

}  // namespace occ
