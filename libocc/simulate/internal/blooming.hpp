// SPDX-License-Identifier: Apache-2.0
// Charge that full wells do not hold runs along the columns.
#pragma once

#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// What charge that spills may add to a pixel at most, whatever else is left out: of what comes
/// before blooming, the change at a pixel may be that much larger.
Bound max_spill(const SceneView& view);

void apply_blooming(const Frame& frame, Signal& signal);

}  // namespace occ::internal::simulate
