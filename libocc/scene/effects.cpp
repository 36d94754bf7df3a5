// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/effects.hpp"

#include <vector>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/yaml_section.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;

namespace {

struct EffectName {
  Effect effect;
  const char* name;
};

constexpr std::array<EffectName, effect_count> effect_names{
    {{Effect::extent, "extent"},
     {Effect::light_gradient, "light_gradient"},
     {Effect::psf, "psf"},
     {Effect::distortion, "distortion"},
     {Effect::vignetting, "vignetting"},
     {Effect::motion_blur, "motion_blur"},
     {Effect::rolling_shutter, "rolling_shutter"},
     {Effect::modulation, "modulation"},
     {Effect::occlusion, "occlusion"},
     {Effect::ambient, "ambient"},
     {Effect::walls, "walls"},
     {Effect::interreflection, "interreflection"},
     {Effect::glare, "glare"},
     {Effect::ghosts, "ghosts"},
     {Effect::mosaic, "mosaic"},
     {Effect::gain, "gain"},
     {Effect::noise, "noise"},
     {Effect::saturation, "saturation"},
     {Effect::blooming, "blooming"},
     {Effect::response, "response"}}};

}  // namespace

const char* effect_name(Effect effect) {
  for (const EffectName& known : effect_names)
    if (known.effect == effect) return known.name;
  require(false, "effect", static_cast<int>(effect), "an enumerator of occ::Effect");
  return nullptr;
}

Effect effect_named(const std::string& name) {
  std::vector<std::string> names;
  for (const EffectName& known : effect_names) {
    if (known.name == name) return known.effect;
    names.emplace_back(known.name);
  }
  require(false, "effect", name, "a known one; " + suggest_key(name, names));
  return {};
}

void Effects::validate() const { check_fields(*this, effects_fields, "effects."); }

}  // namespace occ
