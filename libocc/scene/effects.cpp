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

const char* effect_name(Effect effect) {
  static constexpr std::array<const char*, effect_count> names{
      "extent",      "light_gradient",  "psf",        "distortion", "vignetting",
      "motion_blur", "rolling_shutter", "modulation", "occlusion",  "ambient",
      "walls",       "interreflection", "glare",      "ghosts",     "mosaic",
      "gain",        "noise",           "saturation", "blooming",   "response"};
  return names[static_cast<std::size_t>(effect)];
}

Effect effect_named(const std::string& name) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < effect_count; ++i) {
    names.emplace_back(effect_name(static_cast<Effect>(i)));
    if (names.back() == name) return static_cast<Effect>(i);
  }
  require(false, "effect", name, "a known one; " + suggest_key(name, names));
  return {};
}

void Effects::validate() const { check_fields(*this, effects_fields, "effects."); }

}  // namespace occ
