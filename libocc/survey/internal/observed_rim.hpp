// SPDX-License-Identifier: Apache-2.0
// Rim of a lamp in a picture as observations of the network: the place of its centre, and its
// outline (OutlineObservation). Both together are equivalent to the rim's points y, as predicted
// from a reference, with the covariance W^-1 = D + B C B^T of their own noise D and of the errors C
// that they share (Blob::rim_covariance_px2):
//
//     s = (B^T D^-1 B)^-1 B^T D^-1 y    of which c is the shift; growth and shift alone for sides
//     F = J^T W J - J_c^T C_c^-1 J_c,  g = J^T W y - J_c^T C_c^-1 c
//
// with the derivatives J of y and J_c of c by the unknowns of the outline. F is the information
// that remains when c is known, because c is a linear function of y.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/network/network.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::survey {

/// A disc or rectangle as an outline, and back.
NetworkOutline outline_of(const Lamp& lamp);
void set_outline(const NetworkOutline& outline, Lamp& lamp);

/// Observations of a rim.
struct ObservedRim {
  Eigen::Vector2d centre_px, sigma_px;  ///< projection of the lamp's centre
  OutlineObservation outline;           ///< without the index of its observation
};

/// Rim of a disc or rectangle near a reference: the lamp and the pose. `model_sigma_px`: error of
/// growth, shift and stretch that the rim's covariance does not contain. with_camera: also the
/// derivatives by the camera's parameters. Noise is multiplied if the rim differs more from the
/// lamp's shape. Nothing if the rim does not determine them.
LIBOCC_API std::optional<ObservedRim> observed_rim(const Lamp& lamp, const Blob& blob,
                                                   const Rigid3& cam_from_world,
                                                   const Camera& camera, double model_sigma_px,
                                                   bool with_camera = false);

}  // namespace occ::internal::survey
