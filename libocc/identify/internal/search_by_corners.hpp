// SPDX-License-Identifier: Apache-2.0
// Internal: poses from the corners of one rectangular lamp.
#pragma once

#include <optional>
#include <vector>

#include "libocc/identify/internal/search_by_one_lamp.hpp"

namespace occ::internal::identify {

/// All poses that the four corners of a blob and a rectangle allow, mirror poses and turns of the
/// rectangle included. The camera must be central.
std::vector<LampPose> corner_poses(const AssignmentProblem& problem, const Blob& blob,
                                   const Lamp& lamp);

/// Pose about the centre of the first lamp that fits the corners of all rectangles among the pairs,
/// near the pose `start`. Empty if there are fewer than two rectangles.
std::optional<LampPose> joint_corner_pose(const AssignmentProblem& problem,
                                          const std::vector<Pair>& pairs, const Rigid3& start);

}  // namespace occ::internal::identify
