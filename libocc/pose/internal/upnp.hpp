// SPDX-License-Identifier: Apache-2.0
// Three or more points, from one centre or several, by UPnP (Kneip, Li, Seo, "UPnP: an optimal O(n)
// solution to the absolute pose problem with universal applicability", ECCV 2014): all stationary
// points of the squared object-space error, by OpenGV's elimination template.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

void solve_upnp(const PoseProblem& problem, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
