// SPDX-License-Identifier: Apache-2.0
// Internal: scatter of a board's corners about a smooth grid, beyond their covariances.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::landmarks {

/// Variance per axis [px^2] by which the corners scatter about a smooth grid in addition to their
/// covariances. The grid is a homography and polynomials of degree 3 to 7, for the lens; the best
/// fit counts. The additional variance comes from the print, the board's small waves, and errors of
/// the corner model. It is the moment estimate of a random-effects model (Hedges, "A random effects
/// model for effect sizes", Psychological Bulletin 93, 1983), and 0 if it is negative or if the
/// grid has too few corners. `at`: 2 x n positions on the board in any unit, with at least three
/// different values per axis; px: 2 x n.
double grid_scatter_px2(const Eigen::Matrix2Xd& at, const Eigen::Matrix2Xd& px,
                        const std::vector<Eigen::Matrix2d>& covariances);

}  // namespace occ::internal::landmarks
