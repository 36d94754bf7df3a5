// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/effect_model.hpp"

#include <algorithm>

#include "libocc/core/require.hpp"

namespace occ::internal::simulate {

const std::array<const EffectModel*, effect_count>& effect_models() {
  static const std::array<const EffectModel*, effect_count> models{&ambient_model,
                                                                   &blooming_model,
                                                                   &distortion_model,
                                                                   &extent_model,
                                                                   &gain_model,
                                                                   &ghosts_model,
                                                                   &glare_model,
                                                                   &interreflection_model,
                                                                   &light_gradient_model,
                                                                   &modulation_model,
                                                                   &mosaic_model,
                                                                   &motion_blur_model,
                                                                   &noise_model,
                                                                   &occlusion_model,
                                                                   &psf_model,
                                                                   &response_model,
                                                                   &rolling_shutter_model,
                                                                   &saturation_model,
                                                                   &vignetting_model,
                                                                   &walls_model};
  return models;
}

const EffectModel& effect_model(Effect effect) {
  for (const EffectModel* model : effect_models())
    if (model->effect == effect) return *model;
  require(false, "effect", effect_name(effect), "an effect with a model in simulate/effects/");
  return ambient_model;
}

}  // namespace occ::internal::simulate
