// SPDX-License-Identifier: Apache-2.0
// Internal: neighbours of corners along their edges, and the grids that they form.
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "libocc/landmarks/internal/saddles.hpp"

namespace occ::internal::landmarks {

/// Positions (u, v) in a grid of corners that are linked, with the indices of the corners. u and v
/// are right-handed in the image (v is clockwise of u on a display).
using LinkedGrid = std::map<std::pair<int, int>, std::size_t>;

/// Grids of at least `min_corners` corners, the largest first.
std::vector<LinkedGrid> linked_grids(const GreyLevel& level,
                                     const std::vector<SaddleCorner>& corners,
                                     std::size_t min_corners);

/// Index of the edge of a corner next to a direction; -1 if none is within `min_cosine`.
int edge_along(const SaddleCorner& corner, const Eigen::Vector2d& direction, double min_cosine);

}  // namespace occ::internal::landmarks
