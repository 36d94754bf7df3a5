// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/view.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

constexpr int rim_points = 16;

/// Brightest a fully covered pixel gets: E is monotone over a lamp's image to good approximation,
/// so its extremes are on the rim.
double largest_irradiance(const LampView& view, const Scene& scene, const Rigid3& pose) {
  double largest = irradiance_at(*view.lamp, pose, scene.camera, scene.sensor, view.centre_px);
  for (const Eigen::Vector2d& px : view.rim_px)
    largest = std::max(largest, irradiance_at(*view.lamp, pose, scene.camera, scene.sensor, px));
  constexpr double between_samples = 1.02;
  return between_samples * largest;
}

double peak_electrons(const LampView& view, const Scene& scene) {
  const double sigma = scene.sensor.psf_sigma_px;
  const double along = std::erf(0.5 / (sigma * std::sqrt(2.0)));  // of a point, in one pixel
  const double of_point = view.electrons * along * along;
  if (view.rim_px.empty()) return of_point;
  return std::min(view.full_e, 1.01 * of_point + 1e-3 * view.full_e);
}

bool reaches(const LampView& view, const Camera& camera, double margin_px) {
  const double reach = view.radius_px + margin_px;
  return view.image_centre_px.x() > -reach && view.image_centre_px.x() < camera.width() + reach &&
         view.image_centre_px.y() > -reach && view.image_centre_px.y() < camera.height() + reach;
}

}  // namespace

double View::grey_levels(double electrons) const {
  const Sensor& sensor = scene.sensor;
  if (sensor.response == Response::linear) return sensor.gain_dn_per_e * electrons;
  // The response is steepest at some level; a curve that is concave, at the first.
  constexpr int bases = 256;
  const double dark_e = sensor.electrons(0);
  double most = 0;
  for (int i = 0; i < bases; ++i) {
    const double base = dark_e + (sensor.full_well_e - dark_e) * i / bases;
    most = std::max(most, sensor.grey_level(base + electrons) - sensor.grey_level(base));
  }
  return most;
}

View make_view(const Scene& scene, const Rigid3& cam_from_world, const SimulateOptions& options) {
  constexpr double margin_sigmas = 6;
  View view{scene, cam_from_world, options, {}};
  for (const Lamp& lamp : scene.lamps) {
    LampView seen;
    seen.lamp = &lamp;
    const auto centre = scene.camera.project(cam_from_world * lamp.centre_m);
    const auto rim = project_rim(lamp, cam_from_world, scene.camera, rim_points);
    if (!centre || !rim) continue;
    seen.centre_px = *centre;
    seen.image_centre_px =
        project_lamp_centre(lamp, cam_from_world, scene.camera).value_or(*centre);
    if (lamp.shape != LampShape::point) seen.rim_px = *rim;
    for (const Eigen::Vector2d& px : seen.rim_px)
      seen.radius_px = std::max(seen.radius_px, (px - seen.image_centre_px).norm());
    if (!reaches(seen, scene.camera, margin_sigmas * scene.sensor.psf_sigma_px + 1)) continue;
    seen.electrons = lamp_electrons(lamp, cam_from_world, scene.camera, scene.sensor);
    if (!seen.rim_px.empty())
      seen.full_e = scene.sensor.electrons(largest_irradiance(seen, scene, cam_from_world)) -
                    scene.sensor.electrons(0);
    seen.peak_e = peak_electrons(seen, scene);
    seen.distance_m = (cam_from_world * lamp.centre_m).norm();
    view.lamps.push_back(seen);
  }
  return view;
}

}  // namespace occ
