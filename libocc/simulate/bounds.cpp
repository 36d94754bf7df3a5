// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/room_surfaces.hpp"

namespace occ::internal::simulate {
namespace {

constexpr double blur_sigmas = 5;  // a Gaussian PSF has 4e-6 of its light farther out
constexpr int visibility_rim_points = 16;

double reach_px(const LampView& seen, const SceneView& view) {
  return seen.radius_px + blur_sigmas * blur_sigma_px(view) + blur_radius_px(seen, view) + 1;
}

// Adds the electrons of lamp i and of the lamps that overlap with it.
double sum_around(std::size_t i, const std::vector<double>& electrons,
                  const std::vector<double>& reach, const SceneView& view) {
  double sum = 0;
  for (std::size_t j = 0; j < electrons.size(); ++j) {
    const double apart = (view.lamps[i].image_centre_px - view.lamps[j].image_centre_px).norm();
    if (!(apart > reach[i] + reach[j])) sum += electrons[j];
  }
  return sum;
}

double max_wall_irradiance(const SceneView& view) {
  if (view.max_wall_w_m2) return *view.max_wall_w_m2;
  constexpr double between_samples = 1.3;  // margin: the irradiance is sampled on a grid
  const Scene& scene = view.scene;
  std::vector<double> factors;
  for (const Lamp& lamp : scene.lamps) factors.push_back(max_pixel_factor(scene, lamp.colour));
  view.max_wall_w_m2 = between_samples * RoomSurfaces(scene, factors).max_direct();
  return *view.max_wall_w_m2;
}

// Background of one effect, 0 when it is off or not called for.
double background_of(const SceneView& view, Effect effect) {
  const EffectModel& model = effect_model(effect);
  const bool present =
      model.called_for(view.scene, view.options) && view.scene.effects.of(effect) != Use::off;
  return present ? model.background_e(view) : 0;
}

}  // namespace

Bound sum_of_overlapping(const SceneView& view,
                         Bound (*bound_of)(const LampView& seen, const SceneView& view)) {
  std::vector<Bound> bounds;
  std::vector<double> reach, electrons;
  for (const LampView& seen : view.lamps) {
    bounds.push_back(bound_of(seen, view));
    reach.push_back(reach_px(seen, view) + bounds.back().px);
    electrons.push_back(bounds.back().dn);
  }
  Bound worst;
  for (std::size_t i = 0; i < bounds.size(); ++i)
    worst.include({view.grey_levels(sum_around(i, electrons, reach, view)), bounds[i].px});
  return worst;
}

double max_lamp_electrons(const SceneView& view) {
  std::vector<double> electrons, reach;
  for (const LampView& seen : view.lamps) {
    electrons.push_back(seen.peak_e);
    reach.push_back(reach_px(seen, view));
  }
  // The images of lamps may meet while the camera moves.
  if (!view.options.velocity.isZero(0))
    return std::accumulate(electrons.begin(), electrons.end(), 0.0);
  double brightest = 0;
  for (std::size_t i = 0; i < electrons.size(); ++i)
    brightest = std::max(brightest, sum_around(i, electrons, reach, view));
  return brightest;
}

double surface_electrons(const SceneView& view, double factor) {
  const Sensor& sensor = view.scene.sensor;
  const double exitance = factor * view.scene.room->wall_reflectance * max_wall_irradiance(view);
  const double irradiance = sensor_irradiance(exitance / pi, sensor.f_number, 1);
  return sensor.electrons(irradiance) - sensor.electrons(0);
}

double max_wall_electrons(const SceneView& view) {
  const double walls = background_of(view, Effect::walls);
  if (walls == 0) return 0;
  return walls + background_of(view, Effect::interreflection);
}

double background_electrons(const SceneView& view) {
  return background_of(view, Effect::ambient) + max_wall_electrons(view) +
         background_of(view, Effect::glare) + background_of(view, Effect::ghosts);
}

std::vector<const Lamp*> unseen_lamps(const SceneView& view) {
  std::vector<const Lamp*> unseen;
  for (const Lamp& lamp : view.scene.lamps) {
    const auto is_it = [&](const LampView& seen) { return seen.lamp == &lamp; };
    if (std::none_of(view.lamps.begin(), view.lamps.end(), is_it)) unseen.push_back(&lamp);
  }
  return unseen;
}

bool is_seen_from(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                  const SceneView& view, bool as_point) {
  Lamp seen = lamp;
  if (as_point) seen.shape = LampShape::point;
  const auto rim = project_rim(seen, cam_from_world, camera, visibility_rim_points);
  if (!rim) return false;
  const double margin = blur_sigmas * blur_sigma_px(view) + 2;
  Eigen::Array2d low = rim->front(), high = low;
  for (const Eigen::Vector2d& px : *rim) {
    low = low.min(px.array());
    high = high.max(px.array());
  }
  const Eigen::Array2d size(camera.width(), camera.height());
  return (high > -margin).all() && (low < size + margin).all();
}

bool any_comes_into_view(const SceneView& view, const Motion& motion) {
  constexpr int instants = 64;
  const double duration_s = motion.line_begin_s(motion.lines() - 1) + motion.exposure_s();
  for (const Lamp* lamp : unseen_lamps(view))
    for (int i = 0; i <= instants; ++i)
      if (is_seen_from(*lamp, motion.pose_at(duration_s * i / instants), view.scene.camera, view,
                       false))
        return true;
  return false;
}

}  // namespace occ::internal::simulate
