// SPDX-License-Identifier: Apache-2.0
// Charge that full wells do not hold runs along the columns.
#pragma once

#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ {

void apply_blooming(const Frame& frame, Signal& signal);

}  // namespace occ
