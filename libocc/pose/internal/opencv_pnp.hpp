// SPDX-License-Identifier: Apache-2.0
// The methods of OpenCV's solvePnPGeneric with the signature of Solver::solve.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::pose {

/// `method`: a value of cv::SolvePnPMethod. Appends nothing when a bearing is more than 89.94
/// degrees from the mean bearing or OpenCV rejects the input.
void add_opencv_poses(const PoseProblem& problem, int method, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
