// SPDX-License-Identifier: Apache-2.0
// How much light of a lamp reaches the sensor: irradiance at an image point and the electrons of
// the whole image of the lamp. The sum equals the aperture formula I cos(psi) A / d^2 as the lamp
// shrinks.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>

#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Irradiance [W/m^2] that the extended lamp gives at the pixel whose bearing (camera frame) is
/// given, as if the pixel were inside the lamp's image: Lambertian radiance towards the camera
/// times cos^4.
LIBOCC_API double irradiance_at(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Sensor& sensor, const Eigen::Vector3d& bearing);

/// Signal electrons of the lamp's whole image while lit, by the aperture formula at the lamp's
/// centre with the second-order correction left out: relative error of order (r/d)^2. 0 when it
/// shows its dark side. `jacobian` (1x6): d ln(electrons) / d pose perturbation.
LIBOCC_API double lamp_electrons(const Lamp& lamp, const Rigid3& cam_from_world,
                                 const Camera& camera, const Sensor& sensor,
                                 Eigen::Matrix<double, 1, 6>* log_jacobian = nullptr);

}  // namespace occ
