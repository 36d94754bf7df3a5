// SPDX-License-Identifier: Apache-2.0
// Three points seen from three centres on a rig (Kneip, Furgale, Siegwart, "Using multi-camera
// systems in robotics: efficient solutions to the NPnP problem", ICRA 2013): Groebner basis of the
// rig's rotation and the three depths, of OpenGV.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_gp3p(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
