// SPDX-License-Identifier: Apache-2.0
// Four or more points in space by EPnP (Lepetit, Moreno-Noguer, Fua, IJCV 81, 2009) of OpenGV:
// the points as barycentric combinations of four control points, whose positions are a vector in
// the null space of a linear system.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_epnp(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
