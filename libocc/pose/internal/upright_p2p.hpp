// SPDX-License-Identifier: Apache-2.0
// Two points when the direction of gravity is known (Kukelova, Bujnak, Pajdla, "Closed-form
// solutions to minimal absolute pose problems with known vertical direction", ACCV 2010).
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_upright_p2p(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
