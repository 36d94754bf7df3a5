// SPDX-License-Identifier: Apache-2.0
// Internal: the turn of a disc about its normal, which its outline leaves open.
#pragma once

#include <vector>

#include "libocc/identify/internal/search_by_one_lamp.hpp"

namespace occ::internal::identify {

/// `poses`: of the disc of a pair, arbitrary in its turn. Returns them with the turns that the
/// prior selects, and with those that bring another lamp to another blob; empty if there is no
/// such turn, if the prior leaves more than a third of the circle open, or for more than 16
/// observations.
std::vector<LampPose> turned_poses(const AssignmentProblem& problem, const Pair& pair,
                                   const std::vector<LampPose>& poses);

/// True if the prior permits the disc's pose after some turn.
bool prior_permits_a_turn(const AssignmentProblem& problem, const MapPoint& disc,
                          const LampPose& pose);

}  // namespace occ::internal::identify
