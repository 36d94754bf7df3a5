// SPDX-License-Identifier: Apache-2.0
// P3P over triples of the points: the default for any number of points.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

/// The poses of the triple whose best pose fits all points best, best first. See Solver::solve.
void solve_p3p_triples(const PoseProblem& problem, std::vector<Rigid3>& candidates);

/// The same with `seen` to judge by; `bearings`: unit columns. No more triples are tried once a
/// pose has a chi2 of `enough` or less.
void solve_p3p_triples(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& bearings,
                       const SeenPoints& seen, double enough, std::vector<Rigid3>& candidates);

/// Every point along its unit bearing, all directions equally well known (sigma 1 rad).
LIBOCC_API SeenPoints seen_along(const PoseProblem& problem);

}  // namespace occ::internal::pose
