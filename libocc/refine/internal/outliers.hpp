// SPDX-License-Identifier: Apache-2.0
// Finds a lamp that contradicts the others: Baarda's data snooping (A testing procedure for use in
// geodetic networks, 1968) on the lamps' centroids. Least squares spreads the error of a lamp with
// much leverage over all of them, and Huber's function does not undo that; what does is the drop in
// chi-square if the lamp were left out,
//     T = e^T (C - J S J^T)^-1 e,   e residual, C its covariance, J its derivatives, S the pose's.
#pragma once

#include <cstddef>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/minimise.hpp"

namespace occ::internal::refine {

/// Index of the lamp whose absence lets the others agree so much better that chance would do it
/// once in a thousand, whether the stated sigmas are right (T is chi-square of two degrees) or all
/// too small by one factor (T over the rest's chi-square is Fisher's F); nothing when there is
/// none.
std::optional<std::size_t> contradicting_lamp(const Observations& observations,
                                              const RefineProblem& problem, const Minimum& minimum,
                                              int degrees_of_freedom);

}  // namespace occ::internal::refine
