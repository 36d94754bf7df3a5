// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/predicted_centroid.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"

namespace occ::internal::refine {
namespace {

/// True if the blob is large enough for a rim, but has none.
bool is_uneven_disc(const Lamp& lamp, const Blob& blob) {
  constexpr double min_semi_minor_px = 4;
  return lamp.shape == LampShape::disc && is_whole(blob) && blob.rim.empty() && !blob.saturated &&
         !blob.striped && blob.ellipse.semi_minor_px > min_semi_minor_px;
}

/// The perspective shift of an uneven disc is proportional to the second moments of its light.
Eigen::Vector2d uneven_shift_px(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                                const Scene& scene, const Eigen::Vector2d& uniform_px) {
  const auto shift_px = perspective_shift_px(lamp, cam_from_world, scene.camera, uniform_px);
  const auto axes_px = predicted_axes_px(lamp, cam_from_world, scene.camera);
  if (!shift_px || !axes_px) return Eigen::Vector2d::Zero();
  const double blur2 = 4 * square(formation::gaussian_blur_px(scene));
  const double seen_px2 = std::sqrt((square(blob.ellipse.semi_major_px) - blur2) *
                                    std::max(0.0, square(blob.ellipse.semi_minor_px) - blur2));
  const double share = std::min(1.0, seen_px2 / axes_px->prod());
  return (share - 1) * *shift_px;
}

}  // namespace

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

std::optional<Eigen::Vector2d> perspective_shift_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                    const Camera& camera,
                                                    const Eigen::Vector2d& image_centre_px) {
  const auto centre_px = camera.project(cam_from_world * lamp.centre_m);
  if (!centre_px) return std::nullopt;
  return camera.difference_px(image_centre_px, *centre_px);
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
  if (!px || rung == Rung::points) return px;
  if (is_uneven_disc(lamp, blob)) *px += uneven_shift_px(lamp, blob, cam_from_world, scene, *px);
  *px += light_shift_px(lamp, blob, cam_from_world, scene);
  return px;
}

}  // namespace occ::internal::refine
