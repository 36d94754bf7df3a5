// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/scene_view.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {

constexpr double root_e = 1.6487212707001282;
constexpr int view_rim_points = 16;

// Largest irradiance of a fully covered pixel. The irradiance is monotone over a lamp's image to
// good approximation, so its extremes are on the rim.
double max_irradiance(const LampView& view, const Scene& scene, const Rigid3& pose) {
  double largest = irradiance_at(*view.lamp, pose, scene.camera, scene.sensor, view.centre_px);
  const auto consider = [&](const Eigen::Vector2d& px) {
    largest = std::max(largest, irradiance_at(*view.lamp, pose, scene.camera, scene.sensor, px));
  };
  for (const Eigen::Vector2d& px : view.rim_px) {
    consider(px);
    if (!view.lamp->photometry) continue;
    // A measured emission may have its maximum inside.
    for (const double share : {0.25, 0.5, 0.75})
      consider(view.centre_px + share * (px - view.centre_px));
  }
  constexpr double between_samples = 1.02;  // margin: the rim is sampled
  return between_samples * largest;
}

double peak_electrons(const LampView& seen, const SceneView& view) {
  const double sigma = blur_sigma_px(view);
  const double along =
      std::erf(0.5 / (sigma * std::sqrt(2.0)));  // part of a point's light in one pixel, 1-D
  const double of_point = seen.electrons * along * along;
  if (is_point(seen, view)) return of_point;
  return std::min(seen.full_e, 1.01 * of_point + 1e-3 * seen.full_e);
}

bool reaches(const LampView& view, const Camera& camera, double margin_px) {
  const double reach = view.radius_px + margin_px;
  return view.image_centre_px.x() > -reach && view.image_centre_px.x() < camera.width() + reach &&
         view.image_centre_px.y() > -reach && view.image_centre_px.y() < camera.height() + reach;
}

// Largest change in grey levels by a change in electrons.
double max_change_dn(const Sensor& sensor, double electrons) {
  if (sensor.is_linear()) return sensor.gain_dn_per_e * electrons;
  // The steepest level of a curve is not known in general, so many are tried.
  constexpr int bases = 256;
  const double dark_e = sensor.electrons(0);
  double largest = 0;
  for (int i = 0; i < bases; ++i) {
    const double base = dark_e + (sensor.full_well_e - dark_e) * i / bases;
    largest = std::max(largest, sensor.grey_level(base + electrons) - sensor.grey_level(base));
  }
  return largest;
}

}  // namespace

double SceneView::grey_levels(double electrons) const {
  double largest = max_change_dn(scene.sensor, electrons);
  for (std::size_t place = 0; place < 4 && !scene.sensor.channels.empty(); ++place)
    largest = std::max(largest, max_change_dn(sensor_at(scene.sensor, place), electrons));
  return largest;
}

SceneView make_view(const Scene& scene, const Rigid3& cam_from_world,
                    const SimulateOptions& options) {
  constexpr double margin_sigmas = 6;  // a Gaussian PSF has 2e-8 of its light farther out
  SceneView view{scene, cam_from_world, options, {}};
  for (const Lamp& lamp : scene.lamps) {
    LampView seen;
    seen.lamp = &lamp;
    const auto centre = scene.camera.project(cam_from_world * lamp.centre_m);
    const auto rim = project_rim(lamp, cam_from_world, scene.camera, view_rim_points);
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
      seen.full_e = scene.sensor.electrons(max_irradiance(seen, scene, cam_from_world)) -
                    scene.sensor.electrons(0);
    seen.peak_e = peak_electrons(seen, view);
    const double factor = max_pixel_factor(scene, lamp.colour);
    for (double* electrons : {&seen.electrons, &seen.full_e, &seen.peak_e}) *electrons *= factor;
    seen.distance_m = (cam_from_world * lamp.centre_m).norm();
    view.lamps.push_back(seen);
  }
  return view;
}

double blur_sigma_px(const SceneView& view) {
  return view.scene.effects.of(Effect::psf) == Use::off ? 0 : gaussian_blur_px(view.scene);
}

double blur_radius_px(const LampView& seen, const SceneView& view) {
  if (view.scene.effects.of(Effect::psf) == Use::off) return 0;
  return defocus_radius_px(view.scene,
                           view.scene.camera.depth_m(view.cam_from_world * seen.lamp->centre_m));
}

double blur_width_px(const LampView& seen, const SceneView& view) {
  return std::hypot(blur_sigma_px(view), 0.5 * blur_radius_px(seen, view));
}

bool is_point(const LampView& seen, const SceneView& view) {
  return seen.rim_px.empty() || view.scene.effects.of(Effect::extent) == Use::off;
}

double sampling_shift_px(const LampView& seen, double sigma_px, bool as_point) {
  if (as_point && !(sigma_px > 0)) return std::sqrt(0.5);  // the sum converges slowly
  constexpr int terms = 100;
  Eigen::Array2d low = Eigen::Array2d::Zero(), high = low;
  if (!as_point)
    for (const Eigen::Vector2d& px : seen.rim_px) {
      low = low.min((px - seen.rim_px.front()).array());
      high = high.max((px - seen.rim_px.front()).array());
    }
  double squares = 0;
  for (const double width : {high.x() - low.x(), high.y() - low.y()}) {
    double sum = 0;
    for (int k = 1; k <= terms; ++k) {
      const double spectrum = std::min(1.0, 2 / (pi * k * width));
      sum += spectrum * std::exp(-2 * std::pow(pi * k * sigma_px, 2)) / (pi * k);
    }
    squares += std::pow(std::min(0.5, sum), 2);
  }
  return std::sqrt(squares);
}

double sampling_shift_px(const LampView& seen, const SceneView& view) {
  return sampling_shift_px(seen, blur_sigma_px(view), is_point(seen, view));
}

double change_by_shift_e(const LampView& seen, const SceneView& view, double moved_px) {
  if (!(moved_px > 0)) return 0;
  const double sigma = blur_sigma_px(view);
  const double of_point =
      seen.electrons * std::min(1.0, moved_px / (2 * pi * root_e * std::pow(sigma, 3)));
  if (is_point(seen, view)) return of_point;
  const double slope = std::min(std::sqrt(2.0), 1 / (std::sqrt(2 * pi) * sigma));
  return std::min(of_point, seen.full_e * std::min(1.0, slope * moved_px));
}

double change_by_spread_e(const LampView& seen, const SceneView& view, double length_px) {
  if (!(length_px > 0)) return 0;
  const double sigma = blur_sigma_px(view);
  const double spread = length_px * length_px / 24;
  const double of_point = seen.electrons * std::min(1.0, spread / (2 * pi * std::pow(sigma, 4)));
  if (is_point(seen, view)) return of_point;
  const double bend = 2 / (std::sqrt(2 * pi) * root_e * sigma * sigma);
  const double swept = std::sqrt(2.0) * length_px / 4;
  return std::min(of_point, seen.full_e * std::min({1.0, swept, bend * spread}));
}

}  // namespace occ::internal::simulate
