// SPDX-License-Identifier: Apache-2.0
// Three points by Kneip, Scaramuzza, Siegwart, CVPR 2011, as OpenGV has it, with nothing around it.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_p3p_kneip(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
