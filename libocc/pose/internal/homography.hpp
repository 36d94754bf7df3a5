// SPDX-License-Identifier: Apache-2.0
// Four or more points in a plane by the homography that takes the plane to the bearings (Hartley,
// Zisserman 2004, section 4.1) and its decomposition (Zhang, "A flexible new technique for camera
// calibration", PAMI 22(11), 2000, section 3.1).
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_homography(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
