// SPDX-License-Identifier: Apache-2.0
// Three points by Gao, Hou, Tang, Cheng, "Complete solution classification for the
// perspective-three-point problem", PAMI 25(8), 2003, as OpenGV has it.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_p3p_gao(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
