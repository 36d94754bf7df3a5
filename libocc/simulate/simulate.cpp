// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/simulate.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/expose.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/ghosts.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/modulation.hpp"
#include "libocc/simulate/internal/occlusion.hpp"
#include "libocc/simulate/internal/planning.hpp"
#include "libocc/simulate/internal/room_light.hpp"
#include "libocc/simulate/internal/truth.hpp"

namespace occ {
namespace {

constexpr double no_electrons = 1e-6;  // less than this in a pixel is rounding

// Adds a lamp's image as its blinking lets each line see it; returns the electrons added.
double add_lamp(const Patch& image, const std::vector<double>& lit, bool by_columns,
                const Camera& camera, Signal& signal) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    const double* from = &image.values[static_cast<std::size_t>(y * image.width)];
    double* to =
        &signal[static_cast<std::size_t>(image.y0 + y) * static_cast<std::size_t>(camera.width()) +
                static_cast<std::size_t>(image.x0)];
    for (int x = 0; x < image.width; ++x) {
      const int line = by_columns ? image.x0 + x : image.y0 + y;
      const double electrons = from[x] * lit[static_cast<std::size_t>(line)];
      if (!(electrons > no_electrons)) continue;
      to[x] += electrons;
      sum += electrons;
    }
  }
  return sum;
}

// Light that every pixel gets alike: ambient light, and the lens's glare of the lamps'.
void add_evenly(const Frame& frame, double lamp_electrons, Signal& signal) {
  double electrons = 0;
  const Sensor& sensor = frame.scene.sensor;
  if (frame.plan.applies(Effect::ambient))
    electrons += sensor.electrons(frame.scene.ambient_w_m2) - sensor.electrons(0);
  if (frame.plan.applies(Effect::glare))
    electrons +=
        frame.scene.lens.veiling_glare * lamp_electrons / static_cast<double>(signal.size());
  if (electrons > 0)
    for (double& pixel : signal) pixel += electrons;
}

// Ghosts are what a camera of another focal length sees, turned about its axis where the scale is
// negative. The aperture stays as it is, though it goes with the focal length.
void add_ghosts(const Frame& frame, Signal& signal) {
  for (const Ghost& ghost : frame.scene.lens.ghosts) {
    const GhostView view = ghost_view(frame, ghost);
    const Frame ghost_frame{view.scene, view.cam_from_world, view.options, frame.plan};
    LampRenderer renderer(ghost_frame);
    for (const Lamp& lamp : view.scene.lamps)
      if (const auto image = renderer.render(lamp))
        add_lamp(*image, lit_fractions(lamp, frame), frame.scene.sensor.readout == Readout::columns,
                 view.scene.camera, signal);
  }
}

// A camera inside something that is there sees nothing that could be rendered.
void check_place(const Scene& scene, const Eigen::Vector3d& position) {
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    const Box& box = scene.boxes[i];
    if ((position - box.min_m).minCoeff() > 0 && (box.max_m - position).minCoeff() > 0)
      require(false, "cam_from_world", position.transpose(),
              "outside boxes[" + std::to_string(i) + "]");
  }
  constexpr double touching_m = 1e-6;
  for (const Lamp& lamp : scene.lamps) {
    const Eigen::Vector3d way = position - lamp.centre_m;
    const double across = way.dot(lamp.x_axis), along = way.dot(lamp.normal.cross(lamp.x_axis));
    const bool on_face =
        lamp.shape == LampShape::disc
            ? std::hypot(across, along) < lamp.radius_m
            : std::abs(across) < 0.5 * lamp.size_m.x() && std::abs(along) < 0.5 * lamp.size_m.y();
    if (on_face && std::abs(way.dot(lamp.normal)) < touching_m)
      require(false, "cam_from_world", position.transpose(),
              "outside lamp " + std::to_string(lamp.id));
  }
}

RenderPlan plan_of(const Scene& scene, const Rigid3& pose, const SimulateOptions& options) {
  if (!depends_on_bounds(scene.effects)) return make_plan(scene, options, nullptr);
  const View view = make_view(scene, pose, options);
  return make_plan(scene, options, &view);
}

}  // namespace

void SimulateOptions::validate() const {
  require(std::isfinite(start_s), "start_s", start_s, "finite");
  require(spacing_sigma > 0 && spacing_sigma <= 2, "spacing_sigma", spacing_sigma, "in (0, 2]");
  require(velocity.allFinite(), "velocity", velocity.transpose(), "finite");
}

Rendered simulate(const Scene& given, const Rigid3& cam_from_world,
                  const SimulateOptions& options) {
  Scene scene = given;
  scene.validate();
  options.validate();
  Rendered rendered;
  rendered.cam_from_world = Rigid3::from_matrix(cam_from_world.matrix());
  check_place(scene, rendered.cam_from_world.origin_in_source());
  const RenderPlan plan = plan_of(scene, rendered.cam_from_world, options);
  const Frame frame{scene, rendered.cam_from_world, options, plan};

  const Camera& camera = scene.camera;
  Signal signal(static_cast<std::size_t>(camera.width()) *
                static_cast<std::size_t>(camera.height()));
  const Eigen::Vector3d camera_position = rendered.cam_from_world.origin_in_source();
  double sum = 0;
  LampRenderer renderer(frame);
  for (const Lamp& lamp : scene.lamps) {
    LampTruth truth = lamp_truth(lamp, rendered.cam_from_world, camera);
    if (const auto image = renderer.render(lamp))
      truth.electrons = add_lamp(*image, lit_fractions(lamp, frame),
                                 scene.sensor.readout == Readout::columns, camera, signal);
    if (plan.applies(Effect::occlusion))
      truth.hidden = 1 - visible_part(lamp, scene.boxes, camera_position).share;
    truth.in_view = truth.in_view && truth.hidden < 1;
    sum += truth.electrons;
    rendered.lamps.push_back(truth);
  }
  if (plan.applies(Effect::ghosts)) add_ghosts(frame, signal);
  if (plan.applies(Effect::walls)) add_room_light(frame, signal);
  add_evenly(frame, sum, signal);
  rendered.image = expose(signal, frame);
  return rendered;
}

}  // namespace occ
