// SPDX-License-Identifier: Apache-2.0
// Finds a lamp that contradicts the others: Baarda's data snooping (A testing procedure for use in
// geodetic networks, 1968) on the lamps' centroids. Least squares spreads the error of a lamp with
// large leverage over all residuals, and Huber's loss does not prevent that. The test statistic is
// the decrease of chi-square if the lamp is left out,
//     T = e^T (C - J S J^T)^-1 e,   e residual, C its covariance, J its derivatives, S the pose's.
#pragma once

#include <cstddef>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/minimise.hpp"

namespace occ::internal::refine {

/// Index of the lamp with the most significant contradiction at a probability of 0.1 %. Both tests
/// must reject it: T as chi-square with two degrees of freedom (the stated sigmas are correct), and
/// T over the chi-square of the others as Fisher's F (all sigmas are too small by one factor).
/// Empty if there is none.
std::optional<std::size_t> contradicting_lamp(const Observations& observations,
                                              const RefineProblem& problem, const Minimum& minimum,
                                              int degrees_of_freedom);

/// Leaves out lamps without a centroid, as those cut by the border, whose rims are far from where
/// the centroids of the others predict them: a louvre or a beam cuts such a rim short. Their errors
/// in the scene must be zero; the centroids must determine the pose at this state with redundancy.
void leave_out_false_rims(const State& state, Observations& observations);

}  // namespace occ::internal::refine
