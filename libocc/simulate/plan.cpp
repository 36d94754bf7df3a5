// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/plan.hpp"

#include <algorithm>

#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/blooming.hpp"
#include "libocc/simulate/internal/check_place.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/ghosts.hpp"
#include "libocc/simulate/internal/planning.hpp"

namespace occ {

using namespace internal::simulate;
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

// Ghosts are images of lamps, too; where they are is not asked for.
bool is_of_lamp_images(Effect effect) { return effect <= Effect::occlusion; }

// What spills depends on it.
bool changes_blooming(Effect effect) {
  return effect <= Effect::gain || effect == Effect::saturation;
}

Bound whole_bound(Effect effect, const SceneView& view) {
  const EffectModel& model = model_of(effect);
  Bound bound = model.bound(view);
  if (is_of_lamp_images(effect) && view.scene.effects.of(Effect::ghosts) != Use::off)
    for (const Ghost& ghost : view.scene.lens.ghosts) {
      if (!(ghost.strength > 0)) continue;
      GhostView seen = ghost_view(view.scene, view.cam_from_world, view.options, ghost);
      seen.scene.effects.set(Effect::walls, Use::off);  // those are no ghosts
      bound.dn += model.bound(make_view(seen.scene, seen.cam_from_world, seen.options)).dn;
    }
  if (changes_blooming(effect) && (bound.dn > 0 || bound.px > 0)) {
    const Bound spill = max_spill(view);
    bound.dn += spill.dn;
    bound.px += spill.px;
  }
  return bound;
}

void decide(const EffectModel& model, const Scene& scene, const SimulateOptions& options,
            const SceneView* view, EffectPlan& plan) {
  const Effects& effects = scene.effects;
  plan.called_for = model.called_for(scene, options);
  if (!plan.called_for) {
    plan.reason = std::string("not called for: ") + model.called_for_by;
    return;
  }
  Bound bound;
  if (view) bound = whole_bound(plan.effect, *view);
  plan.bound_dn = std::min<double>(view ? (1 << view->scene.sensor.bit_depth) - 1 : 0, bound.dn);
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
      plan.reason = plan.applied ? "more than the tolerances" : "within the tolerances";
  }
}

EffectPlan& part_of(RenderPlan& plan, Effect effect) {
  return plan.effects[static_cast<std::size_t>(effect)];
}

// An effect is not there without the one that it follows from: who switches it on has both.
void settle_consequences(RenderPlan& plan) {
  for (const auto& [cause, effect] : consequences) {
    EffectPlan& follows = part_of(plan, effect);
    EffectPlan& from = part_of(plan, cause);
    if (!follows.applied || from.applied) continue;
    if (follows.use == Use::automatic) {
      follows.applied = false;
      follows.reason = std::string("not without ") + effect_name(cause);
      continue;
    }
    if (from.use == Use::off)
      require(false, std::string("effects.") + effect_name(effect), "on",
              std::string("off or auto where ") + effect_name(cause) + " is off");
    from.applied = true;
    from.reason = std::string("for ") + effect_name(effect);
  }
}

}  // namespace

RenderPlan internal::simulate::make_plan(const Scene& scene, const SimulateOptions& options,
                                         const SceneView* view) {
  RenderPlan plan;
  for (std::size_t i = 0; i < effect_count; ++i) {
    EffectPlan& part = plan.effects[i];
    part.effect = static_cast<Effect>(i);
    part.use = scene.effects.use[i];
    decide(model_of(part.effect), scene, options, view, part);
  }
  settle_consequences(plan);
  return plan;
}

RenderPlan plan_render(const Scene& given, const Rigid3& cam_from_world,
                       const SimulateOptions& options) {
  Scene scene = given;
  scene.validate();
  options.validate();
  const Rigid3 pose = Rigid3::from_matrix(cam_from_world.matrix());
  check_place(scene, pose.origin_in_source());
  const SceneView view = make_view(scene, pose, options);
  const RenderPlan plan = make_plan(scene, options, &view);
  if (plan.applies(Effect::walls)) check_in_room(scene.room->size_m, pose.origin_in_source());
  return plan;
}

}  // namespace occ
