// SPDX-License-Identifier: Apache-2.0
// Both poses of a plane by IPPE (Collins, Bartoli, "Infinitesimal plane-based pose estimation",
// IJCV 109, 2014) of OpenCV.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_ippe(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
