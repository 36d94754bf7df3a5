// SPDX-License-Identifier: Apache-2.0
// Internal: scatter of a board's corners about a smooth grid, beyond their covariances.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ::internal::landmarks {

/// Variance per axis [px^2] by which the corners scatter about a smooth grid in addition to their
/// covariances. The grid is a homography and polynomials of degree 3 to 7, for the lens. For wide
/// lenses, the homography is also tried in pixels from which an equidistant distortion about the
/// middle of the image is removed, with several focal lengths. The best fit counts. The additional
/// variance comes from the print, the board's small waves, and errors of the corner model. It is
/// the moment estimate of a random-effects model (Hedges, "A random effects model for effect
/// sizes", Psychological Bulletin 93, 1983), and 0 if it is negative or if the grid has too few
/// corners. `at`: 2 x n positions on the board in any unit, with at least three different values
/// per axis; px: 2 x n; middle_px: middle of the image.
double grid_scatter_px2(const Eigen::Matrix2Xd& at, const Eigen::Matrix2Xd& px,
                        const std::vector<Eigen::Matrix2d>& covariances,
                        const Eigen::Vector2d& middle_px);

/// Middle of an image [px].
inline Eigen::Vector2d image_middle(const Image& image) {
  return {0.5 * (image.width - 1), 0.5 * (image.height - 1)};
}

}  // namespace occ::internal::landmarks
