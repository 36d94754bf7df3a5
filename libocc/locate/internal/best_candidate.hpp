// SPDX-License-Identifier: Apache-2.0
// Fills in a fix from its best candidate.
#pragma once

#include "libocc/locate/fix.hpp"

namespace occ::internal::locate {

/// Copies pose, covariance and lamps of the first candidate.
void take_best(Fix& fix);

}  // namespace occ::internal::locate
