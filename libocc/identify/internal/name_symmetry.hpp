// SPDX-License-Identifier: Apache-2.0
// Internal: how the map repeats from one explanation to another.
#pragma once

#include "libocc/identify/internal/explain.hpp"
#include "libocc/identify/symmetry.hpp"

namespace occ::internal::identify {

Symmetry name_symmetry(const AssignmentProblem& problem, const PoseHypothesis& best,
                       const PoseHypothesis& rival);

}  // namespace occ::internal::identify
