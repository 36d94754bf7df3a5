// SPDX-License-Identifier: Apache-2.0
// Internal: which poses stand beside the best one, and the fix that the best one makes.
#pragma once

#include "libocc/locate/fix.hpp"

namespace occ::internal::locate {

/// Poses whose likelihood is within a factor of 100 of the best one's are plausible: 2 ln 100.
inline constexpr double plausible_chi2 = 9.2;

/// Fills in the fix from its first candidate.
void take_best(Fix& fix);

}  // namespace occ::internal::locate
