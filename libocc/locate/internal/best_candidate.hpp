// SPDX-License-Identifier: Apache-2.0
// Internal: which poses stand beside the best one, and the fix that the best one makes.
#pragma once

#include "libocc/locate/fix.hpp"

namespace occ::internal::locate {

/// Fills in the fix from its first candidate.
void take_best(Fix& fix);

}  // namespace occ::internal::locate
