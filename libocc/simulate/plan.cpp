// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/plan.hpp"

#include <sstream>

#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/ghosts.hpp"
#include "libocc/simulate/internal/planning.hpp"

namespace occ {
namespace {

using Models = std::array<const EffectModel*, effect_count>;

const EffectModel& model_of(Effect effect) {
  static const Models models{&extent_model,
                             &light_gradient_model,
                             &psf_model,
                             &distortion_model,
                             &vignetting_model,
                             &motion_blur_model,
                             &rolling_shutter_model,
                             &modulation_model,
                             &occlusion_model,
                             &ambient_model,
                             &walls_model,
                             &interreflection_model,
                             &glare_model,
                             &ghosts_model,
                             &mosaic_model,
                             &gain_model,
                             &noise_model,
                             &saturation_model,
                             &blooming_model,
                             &response_model};
  return *models[static_cast<std::size_t>(effect)];
}

std::string bound_text(const Bound& bound, const Effects& effects) {
  std::ostringstream text;
  text.precision(2);
  const bool within = bound.dn <= effects.tolerance_dn && bound.px <= effects.tolerance_px;
  text << bound.dn << " grey levels, " << bound.px
       << " px: " << (within ? "within the tolerances" : "more than the tolerances");
  return text.str();
}

// Ghosts are images of lamps, too; where they are is not asked for.
bool is_of_lamp_images(Effect effect) {
  switch (effect) {
    case Effect::extent:
    case Effect::light_gradient:
    case Effect::psf:
    case Effect::distortion:
    case Effect::vignetting:
    case Effect::motion_blur:
    case Effect::rolling_shutter:
    case Effect::modulation:
    case Effect::occlusion:
      return true;
    default:
      return false;
  }
}

Bound bound_with_ghosts(Effect effect, const View& view) {
  const EffectModel& model = model_of(effect);
  Bound bound = model.bound(view);
  if (!is_of_lamp_images(effect) || view.scene.effects.of(Effect::ghosts) == Use::off) return bound;
  for (const Ghost& ghost : view.scene.lens.ghosts) {
    if (!(ghost.strength > 0)) continue;
    const GhostView seen = ghost_view(view.scene, view.cam_from_world, view.options, ghost);
    bound.dn += model.bound(make_view(seen.scene, seen.cam_from_world, seen.options)).dn;
  }
  return bound;
}

void decide(const EffectModel& model, const Scene& scene, const SimulateOptions& options,
            const View* view, EffectPlan& plan) {
  const Effects& effects = scene.effects;
  plan.called_for = model.called_for(scene, options);
  if (!plan.called_for) {
    plan.reason = std::string("not called for: ") + model.called_for_by;
    return;
  }
  Bound bound;
  if (view) bound = bound_with_ghosts(plan.effect, *view);
  plan.bound_dn = bound.dn;
  plan.bound_px = bound.px;
  switch (plan.use) {
    case Use::on:
      plan.applied = true;
      plan.reason = "on";
      break;
    case Use::off:
      plan.reason = "off";
      break;
    case Use::automatic:
      // NaN and infinity are no reason to leave it out.
      plan.applied = !(bound.dn <= effects.tolerance_dn && bound.px <= effects.tolerance_px);
      plan.reason = bound_text(bound, effects);
  }
}

// An effect that is rendered without the one that it follows from.
void refuse_contradictions(const RenderPlan& plan) {
  const auto refuse = [&](Effect cause, Effect effect) {
    const EffectPlan& follows = plan.effects[static_cast<std::size_t>(effect)];
    const EffectPlan& from = plan.effects[static_cast<std::size_t>(cause)];
    if (follows.called_for && follows.use == Use::on && from.use == Use::off)
      require(false, std::string("effects.") + effect_name(effect), "on",
              std::string("off or auto where ") + effect_name(cause) + " is off");
  };
  refuse(Effect::walls, Effect::interreflection);
  refuse(Effect::saturation, Effect::blooming);
}

}  // namespace

RenderPlan make_plan(const Scene& scene, const SimulateOptions& options, const View* view) {
  RenderPlan plan;
  for (std::size_t i = 0; i < effect_count; ++i) {
    EffectPlan& part = plan.effects[i];
    part.effect = static_cast<Effect>(i);
    part.use = scene.effects.use[i];
    decide(model_of(part.effect), scene, options, view, part);
  }
  refuse_contradictions(plan);
  return plan;
}

RenderPlan plan_render(const Scene& given, const Rigid3& cam_from_world,
                       const SimulateOptions& options) {
  Scene scene = given;
  scene.validate();
  options.validate();
  const Rigid3 pose = Rigid3::from_matrix(cam_from_world.matrix());
  const View view = make_view(scene, pose, options);
  return make_plan(scene, options, &view);
}

}  // namespace occ
