// SPDX-License-Identifier: Apache-2.0
// Ghosts: second images about the principal point c, a point at p seen at c + s (p - c) too. That
// is what the same camera sees with |s| times the focal length, turned by 180 degrees about its
// axis where s < 0 (the even terms of its distortion change sign). Their light is the lamp's times
// the strength, spread over s^2 of the area; the aperture that goes with the focal length would
// admit s^2 times the light. Left out, a pixel lacks at most strength / s^2 of a fully covered
// one's, for every ghost and all lamps whose ghosts overlap.
#include "libocc/simulate/internal/ghosts.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

// OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty.
std::vector<double> turned(std::vector<double> distortion) {
  for (const std::size_t even : {2u, 3u, 8u, 9u, 10u, 11u, 12u, 13u})
    if (even < distortion.size()) distortion[even] = -distortion[even];
  return distortion;
}

Camera ghost_camera(const Camera& c, double scale) {
  const double s = std::abs(scale);
  return Camera::pinhole(c.width(), c.height(), s * c.fx_px(), s * c.fy_px(), c.cx_px(), c.cy_px(),
                         scale < 0 ? turned(c.distortion()) : c.distortion(), s * c.skew_px());
}

// That a lamp, seen by a camera of s times the focal length, brings to a pixel.
double most_electrons(const Lamp& lamp, const View& view, double s2) {
  constexpr double off_centre = 1.2;  // a lamp's radiance is not the same in all of it
  const Sensor& sensor = view.scene.sensor;
  const double whole =
      lamp_electrons(lamp, view.cam_from_world, view.scene.camera, sensor) * off_centre;
  if (lamp.shape == LampShape::point) return whole;
  const Eigen::Vector3d to_camera = view.cam_from_world.origin_in_source() - lamp.centre_m;
  const double light =
      radiance(lamp.power_w, lamp.order(), lamp.area_m2(), to_camera.normalized().dot(lamp.normal));
  const double covered =
      sensor.electrons(sensor_irradiance(light, sensor.f_number, 1)) - sensor.electrons(0);
  return std::min(off_centre * covered / s2, whole);
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  for (const Ghost& ghost : scene.lens.ghosts)
    if (ghost.strength > 0) return true;
  return false;
}

Bound bound(const View& view) {
  double electrons = 0;
  for (const Ghost& ghost : view.scene.lens.ghosts) {
    const double s2 = ghost.scale * ghost.scale;
    for (const Lamp& lamp : view.scene.lamps)
      electrons += ghost.strength * most_electrons(lamp, view, s2);
  }
  return {view.grey_levels(electrons), 0};
}

}  // namespace

GhostView ghost_view(const Frame& frame, const Ghost& ghost) {
  GhostView view{frame.scene, frame.cam_from_world, frame.options};
  view.scene.camera = ghost_camera(frame.scene.camera, ghost.scale);
  view.scene.sensor.psf_sigma_px = std::hypot(frame.scene.sensor.psf_sigma_px, ghost.blur_px);
  for (Lamp& lamp : view.scene.lamps) lamp.power_w *= ghost.strength / (ghost.scale * ghost.scale);
  if (ghost.scale < 0) {
    const Eigen::Vector3d turn(-1, -1, 1);
    view.cam_from_world.rotation = turn.asDiagonal() * frame.cam_from_world.rotation;
    view.cam_from_world.translation = turn.asDiagonal() * frame.cam_from_world.translation;
    view.options.velocity.head<3>() = turn.asDiagonal() * frame.options.velocity.head<3>();
    view.options.velocity.tail<3>() = turn.asDiagonal() * frame.options.velocity.tail<3>();
  }
  return view;
}

const EffectModel ghosts_model{"lens.ghosts", called_for, bound};

}  // namespace occ
