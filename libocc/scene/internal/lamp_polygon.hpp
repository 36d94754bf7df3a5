// SPDX-License-Identifier: Apache-2.0
// Lamps whose face is a polygon, convex or not.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::scene {

using Corners = std::vector<Eigen::Vector2d>;

/// Checks corners_m. Makes their order counter-clockwise as seen from the lit side, and moves their
/// centroid to centre_m by a change of both. x_axis and normal must be unit and orthogonal. Throws
/// std::invalid_argument naming the lamp if there are fewer than three corners, if they are not
/// finite, or if the outline has no area or crosses or touches itself.
void validate_polygon(Lamp& lamp);

/// True if no corner of a polygon in counter-clockwise order is a hollow.
bool is_convex(const Corners& corners);

/// True for points inside the polygon.
LIBOCC_API bool contains(const Corners& corners, const Eigen::Vector2d& point);

/// Triangles that cover a polygon in counter-clockwise order, as indices of its corners: cuts off
/// one corner after another (Meisters, "Polygons have ears", Am. Math. Monthly 82, 1975).
LIBOCC_API std::vector<std::array<int, 3>> triangles_of(const Corners& corners);

}  // namespace occ::internal::scene
