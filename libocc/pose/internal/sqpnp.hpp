// SPDX-License-Identifier: Apache-2.0
// Three or more points by SQPnP (Terzakis, Lourakis, "A consistently fast and globally optimal
// solution to the perspective-n-point problem", ECCV 2020) of OpenCV.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_sqpnp(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
