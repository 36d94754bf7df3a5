// SPDX-License-Identifier: Apache-2.0
// Which part of a lamp's face is seen past boxes: exact, in the plane of the face.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/scene/scene.hpp"

namespace occ::internal::formation {

/// A convex polygon, counter-clockwise.
using Polygon = std::vector<Eigen::Vector2d>;

/// What of `polygon` lies outside the convex `hole`: convex pieces that do not overlap.
std::vector<Polygon> outside(const Polygon& polygon, const Polygon& hole);

double area(const Polygon& polygon);

/// Axes of a lamp's face: a point of it is centre + u x + v y.
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

/// What of a lamp's face is not hidden.
struct Visible {
  double share = 1;             ///< of its area; of a point lamp 0 or 1
  std::vector<Polygon> pieces;  ///< of the face; empty when all or nothing is seen
};
Visible visible_part(const Lamp& lamp, const std::vector<Box>& boxes,
                     const Eigen::Vector3d& seen_from);

}  // namespace occ::internal::formation
