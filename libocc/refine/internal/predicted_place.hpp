// SPDX-License-Identifier: Apache-2.0
// Where a pose puts a lamp's centroid, rung by rung.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Pixel of the lamp's centre for Rung::points, of the centre of its image for every other; nothing
/// when the lamp cannot be seen. `jacobian` (2x6): d pixel / d pose perturbation.
std::optional<Eigen::Vector2d> predicted_place_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                  const Camera& camera, Rung rung,
                                                  Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

/// How far what was measured of the lamp is off the middle of its image, because its brightness
/// varies across it (Blob::light_response_px2).
Eigen::Vector2d light_shift_px(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                               const Scene& scene);

/// Where the pose puts the blob's centroid: predicted_place_px and, but for Rung::points, the shift
/// by its light, of which the Jacobian takes no notice.
std::optional<Eigen::Vector2d> predicted_centroid_px(
    const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world, const Scene& scene, Rung rung,
    Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

}  // namespace occ::internal::refine
