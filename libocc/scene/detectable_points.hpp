// SPDX-License-Identifier: Apache-2.0
// Finds the points of a triangle mesh that are detectable in an image: vertices where long sharp
// edges meet.
//
// An edge is sharp if its two faces form an angle, or if it has only one face. Edges that continue
// each other in a straight line count as one, so a vertex inside an edge is not detectable. Each
// point gets the cone of viewing directions that best approximates its unoccluded directions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/object.hpp"

namespace occ {

/// Options of detectable_points().
struct LIBOCC_API DetectableOptions {
  double sharp_rad = 0.35;     ///< minimum angle between the normals of a sharp edge's faces
  double straight_rad = 0.35;  ///< two edges with a smaller angle between them count as one
  double min_edge = 0.05;      ///< minimum length of an edge over the diagonal of the bounding box
  int max_points = 30;         ///< the points with the longest edges are kept
  int directions = 400;        ///< number of viewing directions tested for each point

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A vertex that is detectable in an image.
struct DetectablePoint {
  ObjectPoint point;   ///< its id is its rank, from 0
  int edges = 0;       ///< number of long sharp edges that meet there
  double edges_m = 0;  ///< total length of these edges
};

/// Returns the points sorted by the total length of their edges, longest first. Points that are
/// occluded from all directions are left out.
/// vertices: 3 x n [m]; vertices at one place are merged. faces: 3 x m vertex indices,
/// counter-clockwise seen from outside. Throws std::invalid_argument for values that are not
/// finite, indices out of range, an empty list of faces, or options out of range.
LIBOCC_API std::vector<DetectablePoint> detectable_points(const Eigen::Matrix3Xd& vertices,
                                                          const Eigen::Matrix3Xi& faces,
                                                          const DetectableOptions& options = {});

}  // namespace occ
