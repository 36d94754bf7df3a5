// SPDX-License-Identifier: Apache-2.0
// Many points seen from several centres on a rig (Kneip, Furgale, Siegwart, ICRA 2013, section IV):
// EPnP's control points with an inhomogeneous system; its search of the null space is OpenGV's.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_gpnp(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
