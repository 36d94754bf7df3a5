// SPDX-License-Identifier: Apache-2.0
// Limits an assignment problem to the poses near the prior's last pose.
#pragma once

#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {

/// With fewer lamps the search without the last pose is as fast.
inline constexpr std::size_t min_lamps_of_a_search = 7;

/// The prior's last pose, relative to the local frame. The prior must contain it.
Rigid3 last_pose_from_local(const AssignmentProblem& problem);

/// Returns the problem without the assignments that no pose within six sigma of the last pose
/// permits.
AssignmentProblem near_last_pose(const AssignmentProblem& problem);

/// True if the hypothesis is within six sigma of the prior.
bool agrees_with_prior(const AssignmentProblem& problem, const PoseHypothesis& e);

}  // namespace occ::internal::identify
