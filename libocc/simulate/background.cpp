// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/background.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/room_surfaces.hpp"

namespace occ::internal::simulate {
namespace {

double brightest_wall(const SceneView& view) {
  if (view.brightest_wall_w_m2) return *view.brightest_wall_w_m2;
  constexpr double between_samples = 1.3;
  const Scene& scene = view.scene;
  std::vector<double> brightest;
  for (const Lamp& lamp : scene.lamps) brightest.push_back(brightest_factor(scene, lamp.colour));
  view.brightest_wall_w_m2 = between_samples * RoomSurfaces(scene, brightest).largest_direct();
  return *view.brightest_wall_w_m2;
}

// Of a surface with the largest irradiance by the lamps alone, times a factor.
double surface_electrons(const SceneView& view, double factor) {
  const Sensor& sensor = view.scene.sensor;
  const double exitance = factor * view.scene.room->wall_reflectance * brightest_wall(view);
  const double irradiance = sensor_irradiance(exitance / pi, sensor.f_number, 1);
  return sensor.electrons(irradiance) - sensor.electrons(0);
}

// That a lamp, seen by a camera of s times the focal length, brings to a pixel.
double max_electrons(const Lamp& lamp, const SceneView& view, double s2) {
  constexpr double off_centre = 1.2;  // a lamp's radiance is not the same in all of it
  const Sensor& sensor = view.scene.sensor;
  const double whole = lamp_electrons(lamp, view.cam_from_world, view.scene.camera, sensor) *
                       off_centre * brightest_factor(view.scene, lamp.colour);
  if (lamp.shape == LampShape::point) return whole;
  const Eigen::Vector3d to_camera = view.cam_from_world.origin_in_source() - lamp.centre_m;
  const double light =
      radiance(lamp.power_w, lamp.order(), lamp.area_m2(), to_camera.normalized().dot(lamp.normal));
  const double covered =
      (sensor.electrons(sensor_irradiance(light, sensor.f_number, 1)) - sensor.electrons(0)) *
      brightest_factor(view.scene, lamp.colour);
  return std::min(off_centre * covered / s2, whole);
}

double if_there(const SceneView& view, Effect effect, const EffectModel& model,
                double (*electrons)(const SceneView&)) {
  const bool there =
      model.called_for(view.scene, view.options) && view.scene.effects.of(effect) != Use::off;
  return there ? electrons(view) : 0;
}

}  // namespace

double ambient_electrons(const SceneView& view) {
  const Sensor& sensor = view.scene.sensor;
  return brightest_factor(view.scene, Eigen::Vector3d::Ones()) *
         (sensor.electrons(view.scene.ambient_w_m2) - sensor.electrons(0));
}

double wall_electrons(const SceneView& view) { return surface_electrons(view, 1); }

double interreflected_electrons(const SceneView& view) {
  const double reflectance = view.scene.room->wall_reflectance;
  return surface_electrons(view, reflectance / (1 - reflectance));
}

double glare_electrons(const SceneView& view) {
  const Camera& camera = view.scene.camera;
  double electrons = 0;
  for (const LampView& seen : view.lamps) electrons += seen.electrons;
  // The lamp's size over its distance, squared: what the electrons of a point lack.
  constexpr double more = 1.1;
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  return more * view.scene.lens.veiling_glare * electrons / pixels;
}

double ghost_electrons(const SceneView& view) {
  double electrons = 0;
  for (const Ghost& ghost : view.scene.lens.ghosts)
    for (const Lamp& lamp : view.scene.lamps)
      electrons += ghost.strength * max_electrons(lamp, view, ghost.scale * ghost.scale);
  return electrons;
}

double lit_wall_electrons(const SceneView& view) {
  const double walls = if_there(view, Effect::walls, walls_model, wall_electrons);
  if (walls == 0) return 0;
  return walls +
         if_there(view, Effect::interreflection, interreflection_model, interreflected_electrons);
}

double background_electrons(const SceneView& view) {
  return if_there(view, Effect::ambient, ambient_model, ambient_electrons) +
         lit_wall_electrons(view) + if_there(view, Effect::glare, glare_model, glare_electrons) +
         if_there(view, Effect::ghosts, ghosts_model, ghost_electrons);
}

}  // namespace occ::internal::simulate
