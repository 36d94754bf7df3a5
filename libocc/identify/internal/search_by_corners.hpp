// SPDX-License-Identifier: Apache-2.0
// Internal: poses from the corners of one rectangular lamp, where fewer than three lamps match.
#pragma once

#include <vector>

#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {

/// All poses that the corners of one blob and one rectangle allow, with the other blobs that match
/// there; those with the most pairs, by chi2 of the corners. Lists mirror poses and turns of a
/// rectangle. Empty without blobs that have four corners, and for cameras that are not central.
std::vector<PoseHypothesis> corner_hypotheses(const AssignmentProblem& problem);

}  // namespace occ::internal::identify
