// SPDX-License-Identifier: Apache-2.0
// Tests whether a camera at `eye` (world frame, metres) can see a point of the scene. A lamp is
// visible if its lit side faces the camera (Lamp::shows_lit_side), no box hides it (hidden_by_box)
// and its image is within the camera's (Camera::contains). The part of the lamp for which these
// tests must hold depends on the user:
//
//     the whole face   guide/visibility.cpp; refine/expected_lamp.cpp (bound, which ignores boxes)
//     any part         simulate/truth.cpp
//     the centre       track/expected_lamps.cpp, identify/unpaired_lamps.cpp and
//                      locate/suspects.cpp, with its radius
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// True if a box lies between `point` and `eye`.
inline bool hidden_by_box(const std::vector<Box>& boxes, const Eigen::Vector3d& point,
                          const Eigen::Vector3d& eye) {
  return std::any_of(boxes.begin(), boxes.end(),
                     [&](const Box& box) { return box.hides(point, eye); });
}

/// True if `eye` lies inside a box.
inline bool inside_box(const std::vector<Box>& boxes, const Eigen::Vector3d& eye) {
  return std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) { return box.contains(eye); });
}

/// Distance [px] of a pixel from the nearest border of the image (centres of the outermost pixels);
/// negative outside.
inline double border_distance_px(const Camera& camera, const Eigen::Vector2d& px) {
  return std::min({px.x(), px.y(), camera.width() - 1 - px.x(), camera.height() - 1 - px.y()});
}

}  // namespace occ
