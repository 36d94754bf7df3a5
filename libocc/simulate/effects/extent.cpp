// SPDX-License-Identifier: Apache-2.0
// Extent: lamps have a shape. Without the effect, a lamp is a point of the same power at its
// centre. Its light moves by at most R, and its mean squared displacement is s^2 <= R^2/2. Under a
// PSF K of width sigma a pixel changes by at most
//     F s^2/2 max |hess K| + F |d| max |grad K|,   max |hess K| = 1 / (2 pi sigma^4),
//     max |grad K| = 1 / (2 pi sqrt(e) sigma^3),
// with F the lamp's electrons and d the mean displacement, by the offset of the ellipse's centre
// and by the gradient of the light. (The pixel's box makes the image smoother than K.) For a lamp
// of Lambertian order m, the aperture formula of a point is wrong by about (m + 4) (R/f)^2, the
// square of the lamp's size over its distance, and by the square of the light's relative change
// over it. The sampling errors of a point and of a disc differ (internal/scene_view.hpp).
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace extent_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return std::any_of(scene.lamps.begin(), scene.lamps.end(),
                     [](const Lamp& lamp) { return lamp.shape != LampShape::point; });
}

// Second derivative of the intensity by the direction over the intensity: m for a Lambertian lamp,
// and second differences over the angle that the lamp subtends for a measured emission.
double emission_curvature(const Lamp& lamp, const Rigid3& cam_from_world, double size_rad) {
  const internal::scene::LampEmission emission(lamp);
  if (!emission.has_profile()) return emission.order();
  const Eigen::Vector3d direction =
      (cam_from_world.origin_in_source() - lamp.centre_m).normalized();
  const auto intensity = [&](const Eigen::Vector3d& along) {
    return emission.intensity(1, along, along.dot(lamp.normal));
  };
  const double middle = intensity(direction);
  if (!(middle > 0 && size_rad > 0)) return 0;
  const Eigen::Vector3d across = direction.unitOrthogonal(), up = direction.cross(across);
  double sum = 0;
  for (const Eigen::Vector3d& axis : {across, up, Eigen::Vector3d((across + up) / std::sqrt(2.0)),
                                      Eigen::Vector3d((across - up) / std::sqrt(2.0))}) {
    const double mean = 0.5 * (intensity((direction + size_rad * axis).normalized()) +
                               intensity((direction - size_rad * axis).normalized()));
    sum = std::max(sum, 2 * std::abs(mean / middle - 1));
  }
  return 2 * sum / (size_rad * size_rad);
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  if (seen.rim_px.empty()) return {};
  const Camera& camera = view.scene.camera;
  const double sigma2 = std::pow(blur_sigma_px(view), 2);
  const double r2 = seen.radius_px * seen.radius_px;
  const double gradient = log_irradiance_gradient(*seen.lamp, view.cam_from_world, camera,
                                                  view.scene.sensor, seen.centre_px)
                              .norm();
  const double moved = (seen.image_centre_px - seen.centre_px).norm() + 0.5 * r2 * gradient;
  const double size = seen.radius_px / std::min(camera.fx_px(), camera.fy_px());
  const double flux =
      (4 + emission_curvature(*seen.lamp, view.cam_from_world, size)) * size * size +
      0.5 * r2 * gradient * gradient;
  const double spread = (r2 / 4) / (2 * pi * sigma2 * sigma2) +
                        moved / (2 * pi * std::exp(0.5) * std::pow(sigma2, 1.5)) +
                        flux / (2 * pi * sigma2);
  // No pixel changes by more than it receives from the lamp or from the point.
  const double of_point = seen.electrons * std::min(1.0, 1 / (2 * pi * sigma2));
  const double sigma = std::sqrt(sigma2);
  const double sampling =
      sampling_shift_px(seen, sigma, true) + sampling_shift_px(seen, sigma, false);
  return {std::min(seen.electrons * spread, std::max(of_point, seen.full_e)), moved + sampling};
}

Bound bound(const SceneView& view) {
  // A lamp whose rim is partly outside the lens's view is not rendered, but its point is.
  for (const Lamp* lamp : unseen_lamps(view))
    if (is_seen_from(*lamp, view.cam_from_world, view.scene.camera, view, true))
      return {infinity, infinity};
  return sum_of_overlapping(view, bound_of);
}

}  // namespace
}  // namespace extent_effect

const EffectModel extent_model{Effect::extent, Stage::lamp_image, extent_effect::called_for,
                               "all lamps are points", extent_effect::bound};

}  // namespace occ::internal::simulate
