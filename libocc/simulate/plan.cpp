// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/plan.hpp"

#include <algorithm>

#include "libocc/core/require.hpp"
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/planning.hpp"

namespace occ {

using namespace internal::simulate;
namespace {

// Bound on the change by one effect, with its consequences for ghosts and for charge that
// overflows.
Bound total_bound(const EffectModel& model, const SceneView& view) {
  Bound bound = model.bound(view);
  if (model.stage == Stage::lamp_image) add_ghost_bounds(model, view, bound);
  if (model.stage != Stage::output && (bound.dn > 0 || bound.px > 0)) {
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
    plan.reason = std::string("not in the scene: ") + model.absence;
    return;
  }
  Bound bound;
  if (view) bound = total_bound(model, *view);
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
      // An effect with a bound of NaN or infinity is rendered.
      plan.applied = !(bound.dn <= effects.tolerance_dn && bound.px <= effects.tolerance_px);
      plan.reason = plan.applied ? "more than the tolerances" : "within the tolerances";
  }
}

EffectPlan& entry_of(RenderPlan& plan, Effect effect) {
  return plan.effects[static_cast<std::size_t>(effect)];
}

// Makes the plan consistent: an effect is applied only together with the one that it requires.
void apply_requirements(RenderPlan& plan) {
  for (const EffectModel* model : effect_models()) {
    if (!model->required) continue;
    EffectPlan& effect = entry_of(plan, model->effect);
    EffectPlan& required = entry_of(plan, *model->required);
    if (!effect.applied || required.applied) continue;
    if (effect.use == Use::automatic) {
      effect.applied = false;
      effect.reason = std::string("not without ") + effect_name(required.effect);
      continue;
    }
    if (required.use == Use::off)
      require(false, std::string("effects.") + effect_name(effect.effect), "on",
              std::string("off or auto where ") + effect_name(required.effect) + " is off");
    required.applied = true;
    required.reason = std::string("for ") + effect_name(effect.effect);
  }
}

}  // namespace

RenderPlan internal::simulate::make_plan(const Scene& scene, const SimulateOptions& options,
                                         const SceneView* view) {
  RenderPlan plan;
  for (const EffectModel* model : effect_models()) {
    EffectPlan& effect = entry_of(plan, model->effect);
    effect.effect = model->effect;
    effect.use = scene.effects.of(model->effect);
    decide(*model, scene, options, view, effect);
  }
  apply_requirements(plan);
  return plan;
}

RenderPlan plan_render(const Scene& given, const Rigid3& cam_from_world,
                       const SimulateOptions& options) {
  Scene scene = given;
  scene.validate();
  options.validate();
  const Rigid3 pose = Rigid3::from_matrix(cam_from_world.matrix());
  check_camera_position(scene, pose.origin_in_source());
  const SceneView view = make_view(scene, pose, options);
  const RenderPlan plan = make_plan(scene, options, &view);
  if (plan.applies(Effect::walls)) check_inside_room(scene.room->size_m, pose.origin_in_source());
  return plan;
}

}  // namespace occ
