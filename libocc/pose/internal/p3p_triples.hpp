// SPDX-License-Identifier: Apache-2.0
// P3P over triples of the points, for callers that have SeenPoints with covariances.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/point_fit.hpp"

namespace occ::internal::pose {

/// Appends the poses of the triple whose best pose has the smallest chi2 over all points (`seen`),
/// best first. `bearings`: unit columns. Stops at the first triple with a chi2 of `enough` or less.
void solve_p3p_triples(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& bearings,
                       const SeenPoints& seen, double enough, std::vector<Rigid3>& candidates);

}  // namespace occ::internal::pose
