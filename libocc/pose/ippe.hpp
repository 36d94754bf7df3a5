// SPDX-License-Identifier: Apache-2.0
// Both poses of a plane by IPPE (Collins, Bartoli, "Infinitesimal plane-based pose estimation",
// IJCV 109, 2014) of OpenCV.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <vector>

#include "libocc/pose/problem.hpp"

namespace occ {

void solve_ippe(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ
