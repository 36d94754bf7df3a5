// SPDX-License-Identifier: Apache-2.0
// Linear start (homography or DLT) and Levenberg-Marquardt on the image points, OpenCV's
// SOLVEPNP_ITERATIVE.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <vector>

#include "libocc/pose/problem.hpp"

namespace occ {

void solve_iterative(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ
