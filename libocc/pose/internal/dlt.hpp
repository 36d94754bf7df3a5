// SPDX-License-Identifier: Apache-2.0
// Six or more points in space by the direct linear transformation (Hartley, Zisserman, "Multiple
// view geometry in computer vision", 2nd ed., 2004, section 7.1): the projection P with
// f_i x (P X_i) = 0, two equations for each bearing in a basis of its tangent plane.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_dlt(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
