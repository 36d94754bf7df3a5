// SPDX-License-Identifier: Apache-2.0
// Four or more points in space by EPnP (Lepetit, Moreno-Noguer, Fua, IJCV 81, 2009) of OpenGV:
// the points as barycentric combinations of four control points, whose positions are a vector in
// the null space of a linear system.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <vector>

#include "libocc/pose/problem.hpp"

namespace occ {

void solve_epnp(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ
