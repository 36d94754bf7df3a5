// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/view.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/blur.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
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

double peak_electrons(const LampView& seen, const SceneView& view) {
  const double sigma = blur_sigma_px(view);
  const double along = std::erf(0.5 / (sigma * std::sqrt(2.0)));  // of a point, in one pixel
  const double of_point = seen.electrons * along * along;
  if (is_point(seen, view)) return of_point;
  return std::min(seen.full_e, 1.01 * of_point + 1e-3 * seen.full_e);
}

bool reaches(const LampView& view, const Camera& camera, double margin_px) {
  const double reach = view.radius_px + margin_px;
  return view.image_centre_px.x() > -reach && view.image_centre_px.x() < camera.width() + reach &&
         view.image_centre_px.y() > -reach && view.image_centre_px.y() < camera.height() + reach;
}

// Grey levels of a change in electrons, wherever the response is steepest.
double steepest(const Sensor& sensor, double electrons) {
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

}  // namespace

double SceneView::grey_levels(double electrons) const {
  double most = steepest(scene.sensor, electrons);
  for (std::size_t place = 0; place < 4 && !scene.sensor.channels.empty(); ++place)
    most = std::max(most, steepest(sensor_at(scene.sensor, place), electrons));
  return most;
}

SceneView make_view(const Scene& scene, const Rigid3& cam_from_world,
                    const SimulateOptions& options) {
  constexpr double margin_sigmas = 6;
  SceneView view{scene, cam_from_world, options, {}};
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
    const double margin_px = margin_sigmas * blur_sigma_px(view) + blur_radius_px(seen, view) + 1;
    if (!reaches(seen, scene.camera, margin_px)) continue;
    seen.electrons = lamp_electrons(lamp, cam_from_world, scene.camera, scene.sensor);
    if (!seen.rim_px.empty())
      seen.full_e = scene.sensor.electrons(largest_irradiance(seen, scene, cam_from_world)) -
                    scene.sensor.electrons(0);
    seen.peak_e = peak_electrons(seen, view);
    const double brightest = brightest_factor(scene, lamp.colour);
    for (double* electrons : {&seen.electrons, &seen.full_e, &seen.peak_e}) *electrons *= brightest;
    seen.distance_m = (cam_from_world * lamp.centre_m).norm();
    view.lamps.push_back(seen);
  }
  return view;
}

}  // namespace occ::internal::simulate
