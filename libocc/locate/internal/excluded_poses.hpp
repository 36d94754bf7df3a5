// SPDX-License-Identifier: Apache-2.0
// Poses that only the prior excludes (Identification::excluded).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "libocc/refine/internal/ranking.hpp"

namespace occ::internal::locate {

/// Adds them to the poses that agree with the prior, of which the best was refined.
void add_excluded(const refine::RefinementAhead& ahead, const std::vector<Hypothesis>& excluded,
                  refine::Refinement& refinement);

/// If no pose that agrees with `prior` fits: replaces them by the poses of `without_prior`, if one
/// of these fits. Returns true if it does.
bool take_excluded(const refine::RefinementAhead& without_prior, const std::optional<Prior>& prior,
                   const std::function<double()>& elapsed_s, refine::Refinement& refinement);

}  // namespace occ::internal::locate
