// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/mesh_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace occ::internal::scene {
namespace {

Eigen::Vector3d normal_of(const Mesh& mesh, const Eigen::Vector3i& face) {
  const auto at = [&](int k) { return mesh.vertices[face[k]]; };
  return (at(1) - at(0)).cross(at(2) - at(0));
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

// Files such as STL store each face with its own vertices, so vertices at one place are merged.
Mesh welded(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces) {
  constexpr double same = 1e-7;    // distance of merged vertices, over the size: float precision
  constexpr double empty = 1e-14;  // area of an empty triangle, over the size squared
  Mesh mesh;
  const Eigen::Vector3d low = vertices.rowwise().minCoeff();
  mesh.size_m = (vertices.rowwise().maxCoeff() - low).norm();
  std::map<std::array<long, 3>, int> known;
  std::vector<int> index;
  for (const Eigen::Vector3d vertex : vertices.colwise()) {
    const Eigen::Vector3d cell = (vertex - low) / (same * mesh.size_m);
    const std::array<long, 3> key{std::lround(cell.x()), std::lround(cell.y()),
                                  std::lround(cell.z())};
    const auto [place, is_new] = known.emplace(key, static_cast<int>(mesh.vertices.size()));
    if (is_new) mesh.vertices.push_back(vertex);
    index.push_back(place->second);
  }
  for (const Eigen::Vector3i given : faces.colwise()) {
    const auto at = [&](int k) { return index[given[k]]; };
    const Eigen::Vector3i face(at(0), at(1), at(2));
    if (normal_of(mesh, face).norm() > empty * mesh.size_m * mesh.size_m)
      mesh.faces.push_back(face);
  }
  return mesh;
}

SharpEdges sharp_edges(const Mesh& mesh, double sharp_rad) {
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> normals;
  for (const Eigen::Vector3i& face : mesh.faces)
    for (int k = 0; k < 3; ++k) {
      const int a = face[k], b = face[(k + 1) % 3];
      normals[{std::min(a, b), std::max(a, b)}].push_back(normal_of(mesh, face));
    }
  SharpEdges edges(mesh.vertices.size());
  for (const auto& [ends, sides] : normals) {
    if (sides.size() == 2 && angle_between(sides[0], sides[1]) < sharp_rad) continue;
    edges[ends.first].push_back(ends.second);
    edges[ends.second].push_back(ends.first);
  }
  return edges;
}

double edge_length(const Mesh& mesh, const SharpEdges& edges, int from, int towards,
                   double straight_rad) {
  const auto position = [&](int v) { return mesh.vertices[v]; };
  double length = 0;
  int at = from, next = towards;
  for (std::size_t steps = 0; steps < mesh.vertices.size(); ++steps) {
    const Eigen::Vector3d edge = position(next) - position(at);
    length += edge.norm();
    double min_angle = straight_rad;
    int following = -1;
    for (const int end : edges[next]) {
      const double angle = angle_between(edge, position(end) - position(next));
      if (end != at && angle < min_angle) min_angle = angle, following = end;
    }
    if (following < 0 || next == from) break;
    at = next;
    next = following;
  }
  return length;
}

}  // namespace occ::internal::scene
