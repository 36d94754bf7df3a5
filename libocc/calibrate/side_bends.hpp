// SPDX-License-Identifier: Apache-2.0
// How a calibrated camera bends the sides of a tag's image, for measuring its corners again
// (AprilTagOptions::bends_px): the tag's pose from its corners, then the distance from the chord of
// points along each side, b (1 - u^2) for u from -1 to 1 in the mean.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Bends [px] of the sides from corner k to the next; zero outside the camera's domain.
LIBOCC_API std::function<std::array<double, 4>(const std::array<Eigen::Vector2d, 4>& corners_px)>
side_bends(const Camera& camera);

}  // namespace occ
