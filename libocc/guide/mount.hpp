// SPDX-License-Identifier: Apache-2.0
// Mounting of a camera on a vehicle. At pan and tilt 0 the camera looks straight up, with the
// image's x axis forward. Pan rotates it about the vertical, left positive; tilt then bends the
// view from the vertical towards the pan direction: the view is (sin tilt cos pan, sin tilt sin
// pan, cos tilt).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Returns cam_from_body. place_m: position of the camera in the body frame, whose origin is on the
/// floor [m]. Throws std::invalid_argument for arguments that are not finite.
LIBOCC_API Rigid3 camera_on_vehicle(const Eigen::Vector3d& place_m, double pan_rad = 0,
                                    double tilt_rad = 0);

}  // namespace occ
