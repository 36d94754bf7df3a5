// SPDX-License-Identifier: Apache-2.0
// The sharp edges of a triangle mesh.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace occ::internal::scene {

/// Triangles over vertices of which no two are at one place, none of them empty.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> faces;
  double size_m = 0;  ///< diagonal of its box
};

Mesh welded(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces);

/// Of each vertex: those at the other ends of its sharp edges.
using SharpEdges = std::vector<std::vector<int>>;

SharpEdges sharp_edges(const Mesh& mesh, double sharp_rad);

/// How far a sharp edge goes on from a vertex towards the next one, straight but for a little.
double edge_length(const Mesh& mesh, const SharpEdges& edges, int from, int towards,
                   double straight_rad);

}  // namespace occ::internal::scene
