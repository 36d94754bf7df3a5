// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/predicted_centroid.hpp"

#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"

namespace occ::internal::refine {

std::optional<Eigen::Vector2d> predicted_centroid_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                     const Camera& camera, Rung rung,
                                                     Eigen::Matrix<double, 2, 6>* jacobian) {
  if (rung != Rung::points) return project_lamp_centre(lamp, cam_from_world, camera, jacobian);
  if (!lamp.shows_lit_side(cam_from_world.origin_in_source())) return std::nullopt;
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  Eigen::Matrix<double, 2, 3> d_centre;
  const std::optional<Eigen::Vector2d> px = camera.project(centre, jacobian ? &d_centre : nullptr);
  if (px && jacobian) *jacobian = geometry::derivative_by_pose(d_centre, centre);
  return px;
}

Eigen::Vector2d light_shift_px(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                               const Scene& scene) {
  if (blob.light_response_px2.isZero(0)) return Eigen::Vector2d::Zero();
  const auto centre = scene.camera.project(cam_from_world * lamp.centre_m);
  if (!centre) return Eigen::Vector2d::Zero();
  return blob.light_response_px2 *
         log_irradiance_gradient(lamp, cam_from_world, scene.camera, scene.sensor, *centre);
}

std::optional<Eigen::Vector2d> predicted_centroid_px(const Lamp& lamp, const Blob& blob,
                                                     const Rigid3& cam_from_world,
                                                     const Scene& scene, Rung rung,
                                                     Eigen::Matrix<double, 2, 6>* jacobian) {
  auto px = predicted_centroid_px(lamp, cam_from_world, scene.camera, rung, jacobian);
  if (px && rung != Rung::points) *px += light_shift_px(lamp, blob, cam_from_world, scene);
  return px;
}

}  // namespace occ::internal::refine
