// SPDX-License-Identifier: Apache-2.0
// POSIT for a plane (Oberkampf, DeMenthon, Davis, "Iterative pose estimation using coplanar feature
// points", CVIU 63, 1996): scaled orthography leaves two poses, and each is followed on its own.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_posit_coplanar(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
