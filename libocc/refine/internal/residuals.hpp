// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/observations.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Fills in the residual of each lamp and the root mean square over all lamps. For a cut lamp the
/// rim's residual is used, because the centroid is that of its visible part.
LIBOCC_API void report_residuals(const State& state, const std::vector<Match>& matches,
                                 const Observations& observations, const Scene& scene, Rung rung,
                                 Refined& refined);

/// Median distance of the rims that grow from their prediction: a start value of the common growth
/// that is good enough for Huber's weights.
double typical_growth_px(const State& state, const Observations& observations);

}  // namespace occ::internal::refine
