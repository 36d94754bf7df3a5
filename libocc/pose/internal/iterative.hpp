// SPDX-License-Identifier: Apache-2.0
// Linear start (homography or DLT) and Levenberg-Marquardt on the image points, OpenCV's
// SOLVEPNP_ITERATIVE.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_iterative(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
