// SPDX-License-Identifier: Apache-2.0
// Internal: helpers that the ladder's steps share.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/ladder/ladder.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::ladder {

/// The centroids' bearings, points as they are.
PoseProblem bearings_of(const LadderProblem& problem);

/// The candidate that projects the points nearest to where they were seen; no_pose when none has
/// all of them in front.
Result<Rigid3> nearest_candidate(const LadderProblem& problem,
                                 const std::vector<Rigid3>& candidates);

bool is_flat(const LadderProblem& problem);
bool is_deep(const LadderProblem& problem);

/// OpenCV's solvers, called as its users do: image points, camera matrix, distortion.
std::vector<LadderStep> opencv_steps();

}  // namespace occ::internal::ladder
