// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {
bool never(const Scene&, const SimulateOptions&) { return false; }
Bound none(const View&) { return {}; }
}  // namespace

const EffectModel vignetting_model{"pending", never, none};
const EffectModel motion_blur_model{"pending", never, none};
const EffectModel rolling_shutter_model{"pending", never, none};
const EffectModel mosaic_model{"pending", never, none};
const EffectModel gain_model{"pending", never, none};
const EffectModel blooming_model{"pending", never, none};

}  // namespace occ
