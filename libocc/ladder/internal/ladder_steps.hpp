// SPDX-License-Identifier: Apache-2.0
// Helpers of the methods of the ladder.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/ladder/ladder.hpp"
#include "libocc/pose/internal/point_layout.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::ladder {

/// Poses that three of the centroids allow; none if one has no bearing.
std::vector<Rigid3> candidates_of_three(const LadderProblem& problem, const Solver& solver,
                                        const pose::Triple& triple);

bool is_coplanar(const LadderProblem& problem);
bool is_not_coplanar(const LadderProblem& problem);

/// True if a rectangle with corners is matched.
bool has_rectangle(const LadderProblem& problem);
/// True if start_of() may have an answer: three lamps or a rectangle with corners.
bool has_start(const LadderProblem& problem);
/// Start of the refinement: P3P over triples of the lamps or, if there are fewer than three, of the
/// corners.
Result<Rigid3> start_of(const LadderProblem& problem);

/// Methods of the literature that use the shapes of luminaires.
std::vector<LadderStep> shape_steps();

/// OpenCV's solvers, called like its users call them: image points, camera matrix, distortion.
std::vector<LadderStep> opencv_steps();

}  // namespace occ::internal::ladder
