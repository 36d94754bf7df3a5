// SPDX-License-Identifier: Apache-2.0
// The sharp edges of a triangle mesh.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace occ::internal::scene {

/// Triangles of positive area over distinct vertices.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> faces;
  double size_m = 0;  ///< diagonal of its box
};

/// Merges vertices at one place and removes empty triangles.
Mesh welded(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces);

/// For each vertex, the vertices at the other ends of its sharp edges.
using SharpEdges = std::vector<std::vector<int>>;

SharpEdges sharp_edges(const Mesh& mesh, double sharp_rad);

/// Length of the nearly straight chain of sharp edges from a vertex towards a neighbour.
double edge_length(const Mesh& mesh, const SharpEdges& edges, int from, int towards,
                   double straight_rad);

}  // namespace occ::internal::scene
