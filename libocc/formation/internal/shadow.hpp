// SPDX-License-Identifier: Apache-2.0
// Computes the part of a lamp's face that boxes do not hide, exactly, in the plane of the face.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::formation {

/// A convex polygon, counter-clockwise.
using Polygon = std::vector<Eigen::Vector2d>;

/// The part of `polygon` outside the convex `hole`, as convex pieces that do not overlap.
std::vector<Polygon> outside(const Polygon& polygon, const Polygon& hole);

/// Signed area, positive for a counter-clockwise polygon.
double area(const Polygon& polygon);

/// Axes of a lamp's face. Its points are centre + u x + v y.
struct Face {
  Eigen::Vector3d centre, x, y, normal;
  explicit Face(const Lamp& lamp);
  Eigen::Vector3d point(const Eigen::Vector2d& uv) const {
    return centre + uv.x() * x + uv.y() * y;
  }
};

/// Convex region of the face's plane that a box hides from a point in front of the face; empty if
/// it hides no part of the plane. The point must be outside the box.
Polygon shadow(const Box& box, const Face& face, const Eigen::Vector3d& seen_from);

/// Visible part of a lamp's face.
struct Visible {
  double share = 1;             ///< fraction of its area; 0 or 1 for a point lamp
  std::vector<Polygon> pieces;  ///< pieces of the face; empty if all or nothing is visible
};
LIBOCC_API Visible visible_part(const Lamp& lamp, const std::vector<Box>& boxes,
                                const Eigen::Vector3d& seen_from);

}  // namespace occ::internal::formation
