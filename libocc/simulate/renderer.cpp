// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/renderer.hpp"

#include <cmath>
#include <numeric>
#include <optional>

#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/expose.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/planning.hpp"

namespace occ {

using namespace internal::simulate;
namespace {

Scene validated(Scene scene) {
  scene.validate();
  return scene;
}

bool differ_only_in_frame(const SimulateOptions& a, const SimulateOptions& b) {
  return a.noise == b.noise && a.noise_area == b.noise_area && a.start_s == b.start_s &&
         a.spacing_sigma == b.spacing_sigma && a.velocity == b.velocity;
}

}  // namespace

class Renderer::Impl {
 public:
  Impl(const Scene& scene, const RendererOptions& options)
      : scene_(validated(scene)),
        signal_(scene_.camera.width(), scene_.camera.height()),
        exposure_(options.simd),
        storage_(options.simd) {}

  void render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out) {
    options.validate();
    out.cam_from_world = Rigid3::from_matrix(cam_from_world.matrix());
    check_camera_position(scene_, out.cam_from_world.origin_in_source());
    const RenderPlan& plan = plan_of(out.cam_from_world, options);
    const Frame frame{scene_, out.cam_from_world, options, plan, storage_};
    signal_.clear();
    const ByPlace lamp_electrons = add_lamps(frame, out.lamps);
    for (const Effect effect : render_order)
      if (plan.applies(effect)) effect_model(effect).render(frame, lamp_electrons, signal_);
    exposure_.expose(signal_, frame, out);
  }

 private:
  // A plan that does not depend on bounds is reused for the next image.
  const RenderPlan& plan_of(const Rigid3& pose, const SimulateOptions& options) {
    if (depends_on_bounds(scene_.effects)) {
      const SceneView view = make_view(scene_, pose, options);
      plan_ = make_plan(scene_, options, &view);
    } else if (!plan_ || !differ_only_in_frame(options, planned_)) {
      plan_ = make_plan(scene_, options, nullptr);
    }
    planned_ = options;
    return *plan_;
  }

  // Returns the lamps' electrons as EffectModel::render needs them.
  ByPlace add_lamps(const Frame& frame, std::vector<LampTruth>& truths) {
    const LampRenderer renderer(frame);
    ByPlace sum{};
    truths.resize(scene_.lamps.size());
    for (std::size_t i = 0; i < scene_.lamps.size(); ++i) {
      const Lamp& lamp = scene_.lamps[i];
      truths[i] = lamp_truth(lamp, frame, renderer.motion(), renderer.camera());
      if (std::isfinite(scene_.camera.period_px())) {
        truths[i].electrons = add_around_seam(frame, lamp, truths[i]);
      } else {
        if (!renderer.render(lamp, image_)) continue;
        truths[i].electrons = add_lamp(image_, lamp, frame, signal_);
      }
      const ByPlace factors = light_by_place(frame, lamp.colour);
      const double mean = 0.25 * std::accumulate(factors.begin(), factors.end(), 0.0);
      for (std::size_t place = 0; place < sum.size() && mean > 0; ++place)
        sum[place] += truths[i].electrons * factors[place] / mean;
    }
    return sum;
  }

  // In an image that covers 360 degrees, a lamp's image may continue at the other end. It is drawn
  // twice, by cameras whose seam is opposite to the lamp.
  double add_around_seam(const Frame& frame, const Lamp& lamp, LampTruth& truth) {
    const double period = scene_.camera.period_px();
    const double column = truth.centre_px.x();
    const double other = column + (column < 0.5 * period ? period : -period);
    double electrons = 0;
    for (const double at : {column, other}) {
      const LampRenderer renderer(frame, rendered_camera(frame).with_seam_at(at - 0.5 * period));
      if (at == column) truth = lamp_truth(lamp, frame, renderer.motion(), renderer.camera());
      if (renderer.render(lamp, image_)) electrons += add_lamp(image_, lamp, frame, signal_);
    }
    return electrons;
  }

  const Scene scene_;
  Signal signal_;
  Exposure exposure_;
  Storage storage_;
  std::optional<RenderPlan> plan_;
  SimulateOptions planned_;  // options of the plan
  PaddedPatch image_;        // of one lamp at a time
};

Renderer::Renderer(const Scene& scene, const RendererOptions& options)
    : impl_(std::make_unique<Impl>(scene, options)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

void Renderer::render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out) {
  impl_->render(cam_from_world, options, out);
}

}  // namespace occ
