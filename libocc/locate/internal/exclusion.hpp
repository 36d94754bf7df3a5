// SPDX-License-Identifier: Apache-2.0
// Excludes a lamp from the best pose if the pose without it differs significantly
// (refine/separation.hpp). It complements the test of refine() on the lamps' centroids, which needs
// five lamps: the rims of four can contradict each other as well.
#pragma once

#include <vector>

#include "libocc/locate/fix.hpp"
#include "libocc/refine/internal/ranking.hpp"

namespace occ::internal::locate {

/// Refines the best pose without each lamp in turn if a separation exceeds its threshold. If the
/// others agree with each other without exactly one lamp, their pose replaces the best one and the
/// id of that lamp is appended to `excluded`.
void exclude_separated_lamp(const refine::RefinementAhead& ahead, refine::Refinement& refinement,
                            std::vector<int>& excluded);

/// Sets Fix::separation, with the ids of the lamps, and appends lamps that refine() left out to
/// Fix::excluded_lamps.
void take_separation(const Refined& refined, const Scene& scene, double fault_probability,
                     Fix& fix);

}  // namespace occ::internal::locate
