// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/detectable_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/mesh_edges.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

using Eigen::Vector3d;

struct Corner {
  int vertex = 0, edges = 0;
  double edges_m = 0;
};

// Returns true if two of the edges (unit directions) are not in one straight line.
bool is_corner(const std::vector<Vector3d>& edges, double straight_rad) {
  for (const Vector3d& a : edges)
    for (const Vector3d& b : edges)
      if (a.cross(b).norm() > std::sin(straight_rad)) return true;
  return false;
}

std::vector<Corner> corners_of(const Mesh& mesh, const DetectableOptions& options) {
  const SharpEdges edges = sharp_edges(mesh, options.sharp_rad);
  std::vector<Corner> corners;
  for (std::size_t v = 0; v < edges.size(); ++v) {
    Corner corner{static_cast<int>(v), 0, 0};
    std::vector<Vector3d> directions;
    for (const int end : edges[v]) {
      const double length = edge_length(mesh, edges, corner.vertex, end, options.straight_rad);
      if (length < options.min_edge * mesh.size_m) continue;
      corner.edges_m += length;
      directions.push_back((mesh.vertices[end] - mesh.vertices[v]).normalized());
    }
    corner.edges = static_cast<int>(directions.size());
    if (is_corner(directions, options.straight_rad)) corners.push_back(corner);
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.edges_m > b.edges_m; });
  return corners;
}

// Returns true if a ray meets the triangle abc. Source: Moeller, Trumbore, "Fast, minimum storage
// ray/triangle intersection", J. Graphics Tools 2(1), 1997.
bool meets(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& origin,
           const Vector3d& direction) {
  const Vector3d ab = b - a, ac = c - a, p = direction.cross(ac);
  const double det = ab.dot(p);
  if (det == 0) return false;
  const Vector3d t = (origin - a) / det;
  const double u = t.dot(p);
  if (!(u >= 0 && u <= 1)) return false;
  const Vector3d q = t.cross(ab);
  const double v = direction.dot(q);
  return v >= 0 && u + v <= 1 && ac.dot(q) > 0;
}

// Returns true if the ray from a vertex does not meet the body. The faces at the vertex need no
// test: a ray into a closed body leaves it through another face.
bool is_visible(const Mesh& mesh, int vertex, const Vector3d& direction) {
  const Vector3d& origin = mesh.vertices[vertex];
  return std::none_of(mesh.faces.begin(), mesh.faces.end(), [&](const Eigen::Vector3i& face) {
    if ((face.array() == vertex).any()) return false;
    const auto at = [&](int k) { return mesh.vertices[face[k]]; };
    return meets(at(0), at(1), at(2), origin, direction);
  });
}

// Unit vectors distributed evenly over the sphere (Fibonacci lattice).
std::vector<Vector3d> sphere(int count) {
  const double golden_angle = pi * (3 - std::sqrt(5.0));
  std::vector<Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, across = std::sqrt(1 - z * z);
    directions.emplace_back(across * std::cos(i * golden_angle),
                            across * std::sin(i * golden_angle), z);
  }
  return directions;
}

// Half angle of the cone about `normal` that classifies most directions correctly as visible
// (inside) or hidden (outside).
double best_cone(const std::vector<Vector3d>& directions, const std::vector<bool>& visible,
                 const Vector3d& normal) {
  std::vector<std::pair<double, int>> by_angle;  // angle, +1 for visible, -1 for hidden
  for (std::size_t i = 0; i < directions.size(); ++i)
    by_angle.push_back(
        {std::acos(std::clamp(directions[i].dot(normal), -1.0, 1.0)), visible[i] ? 1 : -1});
  std::sort(by_angle.begin(), by_angle.end());
  double cone = by_angle.front().first;
  int score = 0, best = 0;
  for (std::size_t i = 0; i < by_angle.size(); ++i) {
    score += by_angle[i].second;
    if (score <= best) continue;
    best = score;
    cone = i + 1 < by_angle.size() ? 0.5 * (by_angle[i].first + by_angle[i + 1].first) : pi;
  }
  return cone;
}

// Sets the cone of a point. Returns false when the point is hidden from all directions.
bool set_cone(const Mesh& mesh, int vertex, const std::vector<Vector3d>& directions,
              ObjectPoint& point) {
  std::vector<bool> visible;
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& direction : directions) {
    visible.push_back(is_visible(mesh, vertex, direction));
    if (visible.back()) sum += direction;
  }
  const auto count = std::count(visible.begin(), visible.end(), true);
  if (count == 0) return false;
  // If the point is visible from all directions, the sum over the lattice is near zero and no
  // normal is preferred.
  constexpr double min_mean = 1e-2;
  point.normal = sum.norm() > min_mean * static_cast<double>(count) ? Vector3d(sum.normalized())
                                                                    : Vector3d::UnitZ();
  point.cone_rad = best_cone(directions, visible, point.normal);
  return true;
}

}  // namespace

void DetectableOptions::validate() const { check_fields(*this, detectable_fields, ""); }

std::vector<DetectablePoint> detectable_points(const Eigen::Matrix3Xd& vertices,
                                               const Eigen::Matrix3Xi& faces,
                                               const DetectableOptions& options) {
  options.validate();
  require_finite(vertices, "vertices");
  require(faces.cols() > 0, "faces", "none", "at least one");
  for (Eigen::Index i = 0; i < faces.cols(); ++i)
    require(faces.col(i).minCoeff() >= 0 && faces.col(i).maxCoeff() < vertices.cols(),
            "faces[" + std::to_string(i) + "]", faces.col(i).transpose(),
            "indices of the " + std::to_string(vertices.cols()) + " vertices");
  const Mesh mesh = welded(vertices, faces);
  const std::vector<Vector3d> directions = sphere(options.directions);
  std::vector<DetectablePoint> points;
  for (const Corner& corner : corners_of(mesh, options)) {
    DetectablePoint found;
    found.point.id = static_cast<int>(points.size());
    found.point.position_m = mesh.vertices[corner.vertex];
    found.edges = corner.edges;
    found.edges_m = corner.edges_m;
    if (set_cone(mesh, corner.vertex, directions, found.point)) points.push_back(found);
    if (static_cast<int>(points.size()) == options.max_points) break;
  }
  return points;
}

}  // namespace occ
