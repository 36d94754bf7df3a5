// SPDX-License-Identifier: Apache-2.0
// Measured rims for the C++ tests, made from project_rim.
#pragma once

#include <cmath>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/formation/rim.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

/// `count` points of the lamp's projected rim with their outward normals, moved along them by
/// `growth_px`, without the corners of a rectangle. Empty if the rim does not project.
inline std::vector<RimPoint> exact_rim(const Lamp& lamp, const Rigid3& cam_from_world,
                                       const Camera& camera, int count, double sigma_px,
                                       double growth_px = 0) {
  constexpr int fine = 16;  // samples per rim point: the chord across two is the tangent
  const auto dense = project_rim(lamp, cam_from_world, camera, fine * count);
  std::vector<RimPoint> rim;
  if (!dense) return rim;
  const auto middle = project_lamp_centre(lamp, cam_from_world, camera);
  const std::size_t n = dense->size();
  for (std::size_t i = fine / 2; i < n; i += fine) {
    const Eigen::Vector2d before = (*dense)[i] - (*dense)[(i + n - 1) % n];
    const Eigen::Vector2d after = (*dense)[(i + 1) % n] - (*dense)[i];
    const Eigen::Vector2d tangent = (before + after).normalized();
    const bool is_corner = before.normalized().dot(after.normalized()) < 0.99;
    if (is_corner) continue;
    RimPoint point;
    point.normal = {tangent.y(), -tangent.x()};
    if (point.normal.dot((*dense)[i] - *middle) < 0) point.normal = -point.normal;
    point.px = (*dense)[i] + growth_px * point.normal;
    point.sigma_px = sigma_px;
    rim.push_back(point);
  }
  return rim;
}

}  // namespace occ::test
