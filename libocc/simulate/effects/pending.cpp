// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {
bool never(const Scene&, const SimulateOptions&) { return false; }
Bound none(const View&) { return {}; }
}  // namespace

const EffectModel occlusion_model{"pending", never, none};
const EffectModel ambient_model{"pending", never, none};
const EffectModel walls_model{"pending", never, none};
const EffectModel interreflection_model{"pending", never, none};
const EffectModel glare_model{"pending", never, none};
const EffectModel ghosts_model{"pending", never, none};

}  // namespace occ
