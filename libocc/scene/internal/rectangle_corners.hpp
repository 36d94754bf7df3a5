// SPDX-License-Identifier: Apache-2.0
// Corners of a rectangular lamp.
#pragma once

#include <Eigen/Geometry>

#include "libocc/scene/lamp.hpp"

namespace occ::internal::scene {

/// Corners relative to the lamp's centre [m], in the order of Blob::corners_px: clockwise in the
/// image.
inline Eigen::Matrix<double, 3, 4> rectangle_corners(const Lamp& lamp) {
  const Eigen::Vector3d a = 0.5 * lamp.size_m.x() * lamp.x_axis;
  const Eigen::Vector3d b = 0.5 * lamp.size_m.y() * lamp.normal.cross(lamp.x_axis);
  Eigen::Matrix<double, 3, 4> corners;
  corners << a + b, a - b, -a - b, -a + b;
  return corners;
}

}  // namespace occ::internal::scene
