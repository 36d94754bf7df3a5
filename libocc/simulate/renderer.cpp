// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/renderer.hpp"

#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/expose.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/modulation.hpp"
#include "libocc/simulate/internal/planning.hpp"
#include "libocc/simulate/internal/storage.hpp"
#include "libocc/simulate/internal/truth.hpp"

namespace occ {
namespace {

constexpr double no_electrons = 1e-6;  // less than this in a pixel is rounding

// Adds a lamp's image as its blinking lets each line see it; returns the electrons added.
double add_lamp(const Patch& image, const std::vector<double>& lit, bool by_columns,
                Signal& signal) {
  if (image.width == 0) return 0;
  signal.touch({image.x0, image.y0, image.width, image.height});
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    const double* from = &image.values[static_cast<std::size_t>(y * image.width)];
    double* to = signal.row(image.y0 + y) + image.x0;
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

Scene validated(Scene scene) {
  scene.validate();
  return scene;
}

RenderPlan plan_of(const Scene& scene, const Rigid3& pose, const SimulateOptions& options) {
  if (!depends_on_bounds(scene.effects)) return make_plan(scene, options, nullptr);
  const View view = make_view(scene, pose, options);
  return make_plan(scene, options, &view);
}

}  // namespace

class Renderer::Workshop {
 public:
  Workshop(const Scene& scene, const RendererOptions& options)
      : scene_(validated(scene)),
        signal_(scene_.camera.width(), scene_.camera.height()),
        exposure_(options.simd) {}

  void render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out) {
    options.validate();
    out.cam_from_world = Rigid3::from_matrix(cam_from_world.matrix());
    const RenderPlan plan = plan_of(scene_, out.cam_from_world, options);
    const Frame frame{scene_, out.cam_from_world, options, plan, storage_};
    signal_.clear();
    add_lamps(frame, out.lamps);
    exposure_.expose(signal_, frame, out);
  }

 private:
  void add_lamps(const Frame& frame, std::vector<LampTruth>& truths) {
    const LampRenderer renderer(frame);
    const bool by_columns = scene_.sensor.readout == Readout::columns;
    truths.resize(scene_.lamps.size());
    for (std::size_t i = 0; i < scene_.lamps.size(); ++i) {
      const Lamp& lamp = scene_.lamps[i];
      truths[i] = lamp_truth(lamp, frame.cam_from_world, scene_.camera);
      if (const auto image = renderer.render(lamp))
        truths[i].electrons = add_lamp(*image, lit_fractions(lamp, frame), by_columns, signal_);
    }
  }

  const Scene scene_;
  Signal signal_;
  Exposure exposure_;
  Storage storage_;
};

Renderer::Renderer(const Scene& scene, const RendererOptions& options)
    : workshop_(std::make_unique<Workshop>(scene, options)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

void Renderer::render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out) {
  workshop_->render(cam_from_world, options, out);
}

}  // namespace occ
