// SPDX-License-Identifier: Apache-2.0
// Checks that the list of effects is complete: one model per effect, with consistent entries.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace occ::test {
namespace {

using internal::simulate::effect_model;
using internal::simulate::effect_models;
using internal::simulate::EffectModel;
using internal::simulate::render_order;
using internal::simulate::Stage;

std::vector<Effect> all_effects() {
  std::vector<Effect> effects;
  for (std::size_t i = 0; i < effect_count; ++i) effects.push_back(static_cast<Effect>(i));
  return effects;
}

TEST(EffectModels, EachEffectHasExactlyOneModel) {
  for (const Effect effect : all_effects()) {
    const auto is_of_effect = [&](const EffectModel* model) { return model->effect == effect; };
    EXPECT_EQ(std::count_if(effect_models().begin(), effect_models().end(), is_of_effect), 1)
        << effect_name(effect);
    EXPECT_EQ(effect_model(effect).effect, effect) << effect_name(effect);
  }
}

TEST(EffectModels, EachEffectHasItsOwnName) {
  std::set<std::string> names;
  for (const Effect effect : all_effects()) {
    EXPECT_TRUE(names.insert(effect_name(effect)).second) << effect_name(effect);
    EXPECT_EQ(effect_named(effect_name(effect)), effect);
  }
  EXPECT_ANY_THROW(effect_name(static_cast<Effect>(effect_count)));
}

TEST(EffectModels, EachModelIsComplete) {
  for (const EffectModel* model : effect_models()) {
    const std::string name = effect_name(model->effect);
    EXPECT_NE(model->called_for, nullptr) << name;
    EXPECT_NE(model->bound, nullptr) << name;
    EXPECT_FALSE(std::string(model->absence).empty()) << name;
    const auto in_order = std::count(render_order.begin(), render_order.end(), model->effect);
    EXPECT_EQ(in_order, model->render ? 1 : 0) << name;
    if (model->required) {
      EXPECT_NE(*model->required, model->effect) << name;
    }
  }
}

TEST(EffectModels, ThePlanHasEachEffectAtItsIndexWithAReason) {
  Scene scene;
  scene.camera = Camera::pinhole(64, 48, 50, 50, 31.5, 23.5);
  const RenderPlan plan = plan_render(scene, Rigid3{});
  for (const Effect effect : all_effects()) {
    const EffectPlan& planned = plan.effects[static_cast<std::size_t>(effect)];
    EXPECT_EQ(planned.effect, effect);
    EXPECT_FALSE(planned.reason.empty()) << effect_name(effect);
    if (!planned.called_for) {
      EXPECT_EQ(planned.reason, std::string("not in the scene: ") + effect_model(effect).absence);
    }
  }
}

}  // namespace
}  // namespace occ::test
