// SPDX-License-Identifier: Apache-2.0
// Predicted centroid of a lamp, for each rung.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Pixel of the lamp's centre for Rung::points, otherwise of the centre of its image; empty if the
/// lamp is not visible. `jacobian` (2x6): d pixel / d pose perturbation.
std::optional<Eigen::Vector2d> predicted_centroid_px(
    const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera, Rung rung,
    Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

/// Centre of a lamp's image minus the image of its centre, which grows with the square of the
/// lamp's size; empty if the centre is outside the camera's domain.
std::optional<Eigen::Vector2d> perspective_shift_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                    const Camera& camera,
                                                    const Eigen::Vector2d& image_centre_px);

/// Shift of the measured lamp from the middle of its image by the gradient of its brightness
/// (Blob::light_response_px2). That of a tube without a rim is the integral over its light.
LIBOCC_API Eigen::Vector2d light_shift_px(const Lamp& lamp, const Blob& blob,
                                          const Rigid3& cam_from_world, const Scene& scene);

/// Predicted centroid of the blob: predicted_centroid_px plus, except for Rung::points,
/// light_shift_px. The centroid of an uneven disc without a rim is that of a disc with the size of
/// its light, whose centre is closer to that of the lamp. The Jacobian neglects both shifts, but
/// not that of a tube.
LIBOCC_API std::optional<Eigen::Vector2d> predicted_centroid_px(
    const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world, const Scene& scene, Rung rung,
    Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

}  // namespace occ::internal::refine
