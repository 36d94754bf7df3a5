// SPDX-License-Identifier: Apache-2.0
// Four or more points in space by POSIT (DeMenthon, Davis, "Model-based object pose in 25 lines of
// code", IJCV 15, 1995): scaled orthographic pose of image points that are corrected for
// perspective by the pose before. Points are taken relative to their centroid, whose image is
// estimated along.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_posit(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
