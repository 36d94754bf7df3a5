// SPDX-License-Identifier: Apache-2.0
// Internal: bend of a line of a board, for the fit of a corner on it (corner_fit.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::landmarks {

/// Number of other points that determine a bend; farther ones add distortion of higher degrees.
constexpr std::size_t max_bend_points = 6;

/// Bend, as in CornerStart::bends_per_px, of the curve through `corner` that fits other points on
/// the same line of the board best: a parabola, or a cubic curve if there are five or more. Zero
/// for fewer than two points.
Eigen::Vector2d edge_bend(const Eigen::Vector2d& corner,
                          const std::vector<Eigen::Vector2d>& others);

}  // namespace occ::internal::landmarks
