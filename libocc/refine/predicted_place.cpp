// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/predicted_place.hpp"

#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {

std::optional<Eigen::Vector2d> predicted_place_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                  const Camera& camera, Rung rung,
                                                  Eigen::Matrix<double, 2, 6>* jacobian) {
  if (rung != Rung::points) return project_lamp_centre(lamp, cam_from_world, camera, jacobian);
  if (!(lamp.normal.dot(cam_from_world.origin_in_source() - lamp.centre_m) > 0)) {
    return std::nullopt;
  }
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  Eigen::Matrix<double, 2, 3> d_centre;
  const std::optional<Eigen::Vector2d> px = camera.project(centre, jacobian ? &d_centre : nullptr);
  if (px && jacobian) *jacobian << -d_centre * skew(centre), d_centre;
  return px;
}

}  // namespace occ
