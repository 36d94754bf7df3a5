// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/simulate.hpp"

#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/expose.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/modulation.hpp"
#include "libocc/simulate/internal/planning.hpp"
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
  const RenderPlan plan = plan_of(scene, rendered.cam_from_world, options);
  const Frame frame{scene, rendered.cam_from_world, options, plan};

  const Camera& camera = scene.camera;
  Signal signal(static_cast<std::size_t>(camera.width()) *
                static_cast<std::size_t>(camera.height()));
  LampRenderer renderer(frame);
  for (const Lamp& lamp : scene.lamps) {
    LampTruth truth = lamp_truth(lamp, frame);
    if (const auto image = renderer.render(lamp))
      truth.electrons = add_lamp(*image, lit_fractions(lamp, frame),
                                 scene.sensor.readout == Readout::columns, camera, signal);
    rendered.lamps.push_back(truth);
  }
  rendered.image = expose(signal, frame);
  return rendered;
}

}  // namespace occ
