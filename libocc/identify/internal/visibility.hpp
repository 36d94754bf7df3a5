// SPDX-License-Identifier: Apache-2.0
// Internal: what a pose says about the lamps that no whole blob was paired with.
#pragma once

#include "libocc/identify/internal/explain.hpp"

namespace occ::internal::identify {

/// Gives weak blobs (cut by the border, merged) to lamps that must be there, and counts and charges
/// the lamps that should be well inside the image but are not.
void account_for_unpaired(const AssignmentProblem& problem, PoseHypothesis& explanation);

}  // namespace occ::internal::identify
