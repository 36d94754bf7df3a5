// SPDX-License-Identifier: Apache-2.0
// Rivals of a pose whose lamps contradict each other. Identification took the map as exact (or with
// the errors that the scene states), so it rejected other assignments whose misfit is no larger
// than the errors of the map that the best pose itself turned out to need.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/refine/internal/ranking.hpp"

namespace occ::internal::locate {

/// Adds poses whose probabilities are relative to those of the refinement, which sum to 1, and
/// sorts.
LIBOCC_API void append_rivals(std::vector<refine::RankedPose> rivals,
                              refine::Refinement& refinement);

/// Searches again with the estimated errors of the map, if the best pose needs some, and adds the
/// poses of other assignments with their probabilities. `found` keeps their hypotheses.
void add_rivals_of_wrong_map(const refine::RefinementAhead& ahead,
                             const std::function<double()>& elapsed_s,
                             std::deque<Hypothesis>& found, refine::Refinement& refinement);

}  // namespace occ::internal::locate
