// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/predicted_centroid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

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

bool is_tube(const Lamp& lamp) {
  constexpr double min_elongation = 3;
  return lamp.shape == LampShape::rectangle &&
         lamp.size_m.maxCoeff() > min_elongation * lamp.size_m.minCoeff();
}

/// True if the centroid of the blob is that of its light, and the lamp is so long that its
/// brightness changes too much along it for a gradient at its centre.
bool is_tube_by_light(const Lamp& lamp, const Blob& blob) {
  return is_tube(lamp) && blob.rim.empty() && !blob.saturated && !blob.light_response_px2.isZero(0);
}

/// Shift of a tube's centroid from `area_px` by its light, by Gauss-Legendre integration, and the
/// derivative of the shifted centroid by the pose.
std::optional<Eigen::Vector2d> tube_shift_px(const Lamp& tube, const Rigid3& cam_from_world,
                                             const Scene& scene, const Eigen::Vector2d& area_px,
                                             Eigen::Matrix<double, 2, 6>* jacobian) {
  struct Node {
    double place, weight;
  };
  constexpr Node along[] = {{-0.3872983346207417, 5}, {0, 8}, {0.3872983346207417, 5}};
  constexpr double across[] = {-0.28867513459481287, 0.28867513459481287};
  Eigen::Vector3d side = tube.size_m.x() * tube.x_axis;
  Eigen::Vector3d width = tube.size_m.y() * tube.normal.cross(tube.x_axis);
  if (tube.size_m.x() < tube.size_m.y()) std::swap(side, width);
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  double total = 0;
  Eigen::Matrix<double, 2, 6> by_pose = Eigen::Matrix<double, 2, 6>::Zero();
  Eigen::Matrix<double, 1, 6> total_by_pose = Eigen::Matrix<double, 1, 6>::Zero();
  Lamp part = tube;
  for (const Node& node : along)
    for (const double beside : across) {
      part.centre_m = tube.centre_m + node.place * side + beside * width;
      const Eigen::Vector3d in_cam = cam_from_world * part.centre_m;
      Eigen::Matrix<double, 2, 3> d_point;
      Eigen::Matrix<double, 1, 6> d_log_light;
      const auto px = scene.camera.project(in_cam, jacobian ? &d_point : nullptr);
      if (!px) return std::nullopt;
      const double light =
          node.weight * lamp_electrons(part, cam_from_world, scene.camera, scene.sensor,
                                       jacobian ? &d_log_light : nullptr);
      const Eigen::Vector2d from_area = scene.camera.difference_px(*px, area_px);
      shift += light * from_area;
      total += light;
      if (!jacobian) continue;
      by_pose += light * (geometry::derivative_by_pose(d_point, in_cam) + from_area * d_log_light);
      total_by_pose += light * d_log_light;
    }
  if (!(total > 0)) return std::nullopt;
  shift /= total;
  if (jacobian) *jacobian = (by_pose - shift * total_by_pose) / total;
  return shift;
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
  if (is_tube_by_light(lamp, blob)) {
    const auto area_px = project_lamp_centre(lamp, cam_from_world, scene.camera);
    if (!area_px) return Eigen::Vector2d::Zero();
    const auto shift = tube_shift_px(lamp, cam_from_world, scene, *area_px, nullptr);
    return shift.value_or(Eigen::Vector2d::Zero());
  }
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
  if (is_tube_by_light(lamp, blob)) {
    const auto shift = tube_shift_px(lamp, cam_from_world, scene, *px, jacobian);
    if (shift) *px += *shift;
    return px;
  }
  if (is_uneven_disc(lamp, blob)) *px += uneven_shift_px(lamp, blob, cam_from_world, scene, *px);
  *px += light_shift_px(lamp, blob, cam_from_world, scene);
  return px;
}

}  // namespace occ::internal::refine
