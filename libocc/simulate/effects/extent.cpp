// SPDX-License-Identifier: Apache-2.0
// Lamps have a shape. Left out, a lamp is a point of its power at its centre: its light moves by at
// most R, by s^2 <= R^2/2 in the mean of squares, so that under a PSF K (width sigma, pixel box
// included it is smoother) a pixel changes by at most
//     F s^2/2 max |hess K| + F |m| max |grad K|,   max |hess K| = 1 / (2 pi sigma^4),
// with max |grad K| = 1 / (2 pi sqrt(e) sigma^3), F the lamp's electrons and m the mean
// displacement: that of the ellipse's centre and that of the light's gradient over it. The aperture
// formula of a point is off by (R/f)^2, about the square of the lamp's size over its distance.
#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

constexpr double pi = 3.14159265358979323846;

bool called_for(const Scene& scene, const SimulateOptions&) {
  return std::any_of(scene.lamps.begin(), scene.lamps.end(),
                     [](const Lamp& lamp) { return lamp.shape != LampShape::point; });
}

Bound bound(const View& view) {
  Bound bound;
  const Camera& camera = view.scene.camera;
  const double sigma2 = std::pow(view.scene.sensor.psf_sigma_px, 2);
  const double focal = std::min(camera.fx_px(), camera.fy_px());
  for (const LampView& seen : view.lamps) {
    if (seen.rim_px.empty()) continue;
    const double r2 = seen.radius_px * seen.radius_px;
    const double gradient = log_irradiance_gradient(*seen.lamp, view.cam_from_world, camera,
                                                    view.scene.sensor, seen.centre_px)
                                .norm();
    const double moved = (seen.image_centre_px - seen.centre_px).norm() + 0.5 * r2 * gradient;
    const double size = seen.radius_px / focal;
    const double spread = (r2 / 4) / (2 * pi * sigma2 * sigma2) +
                          moved / (2 * pi * std::exp(0.5) * std::pow(sigma2, 1.5)) +
                          4 * size * size / (2 * pi * sigma2);
    // No pixel can change by more than what it has, or what the point gives it.
    const double of_point = seen.electrons * std::min(1.0, 1 / (2 * pi * sigma2));
    bound.include(
        {view.grey_levels(std::min(seen.electrons * spread, std::max(of_point, seen.peak_e))),
         moved});
  }
  return bound;
}

}  // namespace

const EffectModel extent_model{"a lamp's shape", called_for, bound};

}  // namespace occ
