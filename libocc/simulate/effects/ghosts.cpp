// SPDX-License-Identifier: Apache-2.0
// Ghosts: second images of the lamps by reflections inside the lens. A point at p is also seen at
// c + s (p - c), about the principal point c. A camera with |s| times the focal length, rotated by
// 180 degrees about its axis if s < 0, sees the ghost as its normal image (the even terms of the
// distortion change sign then). A panorama has no principal point, so it is rejected. The light of
// a ghost is the lamp's times the strength, spread over s^2 of the area. The aperture stays that of
// the real focal length. Without the effect, a pixel lacks at most strength / s^2 of a fully
// covered pixel, for each ghost and all lamps whose ghosts overlap.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {
namespace ghosts_effect {
namespace {

// True for coefficients of a displacement that is an even function of the position.
bool is_even(const std::string& name) {
  constexpr std::array<const char*, 10> even{"p1", "p2", "s1", "s2",    "s3",
                                             "s4", "b1", "b2", "tau_x", "tau_y"};
  return std::find(even.begin(), even.end(), name) != even.end();
}

Camera ghost_camera(const Camera& c, double scale) {
  const double s = std::abs(scale);
  const std::vector<CameraParameter> parameters = c.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const CameraParameter& parameter = parameters[static_cast<std::size_t>(i)];
    const bool is_scaled =
        parameter.name == "fx_px" || parameter.name == "fy_px" || parameter.name == "skew_px";
    const double sign = scale < 0 && is_even(parameter.name) ? -1 : 1;
    values[i] = sign * (is_scaled ? s : 1) * parameter.value;
  }
  const bool forward = c.kind() == CameraKind::brown_forward;
  if (!forward && c.kind() != CameraKind::brown_backward) return c.with_parameters(values);
  // Brown's distortion is a function of coordinates in units of unit_px, which grows with s.
  const std::vector<double> distortion(values.begin() + 5, values.end());
  const double unit_px = s * c.constants()[0].value, r0 = c.constants()[1].value;
  return (forward ? Camera::brown_forward : Camera::brown_backward)(
      c.width(), c.height(), values[0], values[1], values[2], values[3], distortion, unit_px, r0,
      values[4]);
}

// A scene and pose whose normal image is the ghost.
struct GhostView {
  Scene scene;
  Rigid3 cam_from_world;
  SimulateOptions options;
};

GhostView ghost_view(const Scene& scene, const Rigid3& cam_from_world,
                     const SimulateOptions& options, const Ghost& ghost) {
  const bool is_panorama = std::isfinite(scene.camera.period_px());
  require(!is_panorama, "lens.ghosts", scene.lens.ghosts.size(),
          "empty for a panorama, which has no principal point");
  GhostView view{scene, cam_from_world, options};
  view.scene.camera = ghost_camera(scene.camera, ghost.scale);
  view.scene.sensor.psf_sigma_px = std::hypot(scene.sensor.psf_sigma_px, ghost.blur_px);
  for (Lamp& lamp : view.scene.lamps) lamp.power_w *= ghost.strength / (ghost.scale * ghost.scale);
  if (ghost.scale < 0) {
    const Eigen::Vector3d rotation(-1, -1, 1);  // by 180 degrees about the optical axis
    view.cam_from_world.rotation = rotation.asDiagonal() * cam_from_world.rotation;
    view.cam_from_world.translation = rotation.asDiagonal() * cam_from_world.translation;
    view.options.velocity.head<3>() = rotation.asDiagonal() * options.velocity.head<3>();
    view.options.velocity.tail<3>() = rotation.asDiagonal() * options.velocity.tail<3>();
  }
  return view;
}

// Radiance of the lamp's centre towards the camera; of a measured emission the largest radiance of
// points of its face, since it may vary strongly over the face.
double max_radiance(const Lamp& lamp, const Eigen::Vector3d& camera) {
  const internal::scene::LampEmission emission(lamp);
  const auto radiance_of = [&](const Eigen::Vector3d& point) {
    const Eigen::Vector3d to_camera = camera - point;
    return emission.radiance(lamp.power_w, lamp.area_m2(), to_camera,
                             to_camera.normalized().dot(lamp.normal));
  };
  double largest = radiance_of(lamp.centre_m);
  if (!lamp.photometry) return largest;
  const Eigen::Vector3d across = lamp.normal.cross(lamp.x_axis);
  constexpr int around = 8, rings = 3;
  for (int ring = 1; ring <= rings; ++ring)
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * pi * i / around;
      largest = std::max(largest, radiance_of(lamp.centre_m + lamp.reach_m() * ring / rings *
                                                                  (std::cos(angle) * lamp.x_axis +
                                                                   std::sin(angle) * across)));
    }
  return largest;
}

// Upper limit of the electrons that a lamp brings to a pixel of a camera with s times the focal
// length.
double max_electrons(const Lamp& lamp, const SceneView& view, double s2) {
  constexpr double off_centre = 1.2;  // margin: a lamp's radiance varies over its face
  const Sensor& sensor = view.scene.sensor;
  const double whole = lamp_electrons(lamp, view.cam_from_world, view.scene.camera, sensor) *
                       off_centre * max_pixel_factor(view.scene, lamp.colour);
  if (lamp.shape == LampShape::point) return whole;
  const double light = max_radiance(lamp, view.cam_from_world.origin_in_source());
  const double covered =
      (sensor.electrons(sensor_irradiance(light, sensor.f_number, 1)) - sensor.electrons(0)) *
      max_pixel_factor(view.scene, lamp.colour);
  // `whole` follows from the light of the centre alone.
  if (lamp.photometry) return off_centre * covered / s2;
  return std::min(off_centre * covered / s2, whole);
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  for (const Ghost& ghost : scene.lens.ghosts)
    if (ghost.strength > 0) return true;
  return false;
}

double background_e(const SceneView& view) {
  double electrons = 0;
  for (const Ghost& ghost : view.scene.lens.ghosts)
    for (const Lamp& lamp : view.scene.lamps)
      electrons += ghost.strength * max_electrons(lamp, view, ghost.scale * ghost.scale);
  return electrons;
}

Bound bound(const SceneView& view) { return {view.grey_levels(background_e(view)), 0}; }

void render(const Frame& frame, const ByPlace&, Signal& signal) {
  for (const Ghost& ghost : frame.scene.lens.ghosts) {
    const GhostView view = ghost_view(frame.scene, frame.cam_from_world, frame.options, ghost);
    const Frame ghost_frame{view.scene, view.cam_from_world, view.options, frame.plan,
                            frame.storage};
    const LampRenderer renderer(ghost_frame);
    PaddedPatch image;
    for (const Lamp& lamp : view.scene.lamps)
      if (renderer.render(lamp, image)) add_lamp(image, lamp, ghost_frame, signal);
  }
}

}  // namespace
}  // namespace ghosts_effect

void add_ghost_bounds(const EffectModel& model, const SceneView& view, Bound& bound) {
  if (view.scene.effects.of(Effect::ghosts) == Use::off) return;
  for (const Ghost& ghost : view.scene.lens.ghosts) {
    if (!(ghost.strength > 0)) continue;
    ghosts_effect::GhostView seen =
        ghosts_effect::ghost_view(view.scene, view.cam_from_world, view.options, ghost);
    seen.scene.effects.set(Effect::walls, Use::off);  // ghosts of the walls are not rendered
    bound.dn += model.bound(make_view(seen.scene, seen.cam_from_world, seen.options)).dn;
  }
}

const EffectModel ghosts_model = [] {
  EffectModel model{Effect::ghosts, Stage::charge, ghosts_effect::called_for,
                    "lens.ghosts has no ghost with a positive strength", ghosts_effect::bound};
  model.background_e = ghosts_effect::background_e;
  model.render = ghosts_effect::render;
  return model;
}();

}  // namespace occ::internal::simulate
