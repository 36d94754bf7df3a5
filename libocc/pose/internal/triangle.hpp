// SPDX-License-Identifier: Apache-2.0
// Three points by the numeric triangle method (DeMenthon, lecture "Object pose from a single
// image"): search over one angle of the triangle; the law of sines gives a side's two distances,
// the other side then has two lengths of its third distance, and the third side's length decides.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_triangle(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
