// SPDX-License-Identifier: Apache-2.0
// The solvers of OpenCV's solvePnPGeneric behind our signature.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

/// method: a value of cv::SolvePnPMethod. Appends nothing when a bearing is more than 89.94 degrees
/// from the mean one or OpenCV refuses.
void add_opencv_poses(const PoseProblem& problem, int method, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
