// SPDX-License-Identifier: Apache-2.0
// Internal: how the map repeats from one explanation to another.
#pragma once

#include "libocc/identify/explain.hpp"
#include "libocc/identify/symmetry.hpp"

namespace occ::naming {

Symmetry name_symmetry(const Problem& problem, const Explanation& best, const Explanation& rival);

}  // namespace occ::naming
