// SPDX-License-Identifier: Apache-2.0
// Which points of a body can be found in an image of it: vertices where long sharp edges meet. An
// edge is sharp where its faces make an angle, or where it has one face only; edges that continue
// each other are one, so that a point in the middle of an edge is none. Each vertex has the cone of
// directions that agrees best with where no face hides it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/object.hpp"

namespace occ {

struct LIBOCC_API DetectableOptions {
  double sharp_rad = 0.35;     ///< least angle between the normals of a sharp edge's faces
  double straight_rad = 0.35;  ///< edges that turn by less than this continue each other
  double min_edge = 0.05;      ///< shorter edges do not count; of its box's diagonal
  int max_points = 30;         ///< with the longest edges
  int directions = 400;        ///< from which each point is looked at

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct DetectablePoint {
  ObjectPoint point;   ///< id: its rank, from 0
  int edges = 0;       ///< that meet there and are long and sharp
  double edges_m = 0;  ///< their length
};

/// Longest edges first. vertices: columns [m]; faces: columns of three indices, each counter-
/// clockwise seen from outside; vertices at one place are one. Points that are hidden from
/// everywhere are left out. Throws std::invalid_argument for values that are not finite, indices
/// out of range, no faces, or options out of range.
LIBOCC_API std::vector<DetectablePoint> detectable_points(const Eigen::Matrix3Xd& vertices,
                                                          const Eigen::Matrix3Xi& faces,
                                                          const DetectableOptions& options = {});

}  // namespace occ
