// SPDX-License-Identifier: Apache-2.0
// Visible part of a lamp's face behind boxes, computed exactly in the plane of the face.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/scene/scene.hpp"

namespace occ::internal::formation {

/// A convex polygon, counter-clockwise.
using Polygon = std::vector<Eigen::Vector2d>;

/// Part of `polygon` outside the convex `hole`, as convex pieces that do not overlap.
std::vector<Polygon> outside(const Polygon& polygon, const Polygon& hole);

double area(const Polygon& polygon);

/// Axes of a lamp's face; its points are centre + u x + v y.
struct Face {
  Eigen::Vector3d centre, x, y, normal;
  explicit Face(const Lamp& lamp);
  Eigen::Vector3d point(const Eigen::Vector2d& uv) const {
    return centre + uv.x() * x + uv.y() * y;
  }
};

/// The convex region of the face's plane that a box hides from a point in front of the face; empty
/// when it hides nothing of the plane. The point lies outside the box.
Polygon shadow(const Box& box, const Face& face, const Eigen::Vector3d& seen_from);

/// Visible part of a lamp's face.
struct Visible {
  double share = 1;             ///< visible share of the area; 0 or 1 for a point lamp
  std::vector<Polygon> pieces;  ///< visible pieces; empty if all or nothing is visible
};
Visible visible_part(const Lamp& lamp, const std::vector<Box>& boxes,
                     const Eigen::Vector3d& seen_from);

}  // namespace occ::internal::formation
