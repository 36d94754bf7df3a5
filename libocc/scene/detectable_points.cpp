// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/detectable_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/mesh_edges.hpp"

namespace occ {

using namespace internal::scene;
namespace {

using Eigen::Vector3d;

struct Corner {
  int vertex = 0, edges = 0;
  double edges_m = 0;
};

// A vertex at which long edges meet that are not one.
bool is_corner(const std::vector<Vector3d>& ways, double straight_rad) {
  for (const Vector3d& a : ways)
    for (const Vector3d& b : ways)
      if (a.cross(b).norm() > std::sin(straight_rad)) return true;
  return false;
}

std::vector<Corner> corners_of(const Mesh& mesh, const DetectableOptions& options) {
  const SharpEdges edges = sharp_edges(mesh, options.sharp_rad);
  std::vector<Corner> corners;
  for (std::size_t v = 0; v < edges.size(); ++v) {
    Corner corner{static_cast<int>(v), 0, 0};
    std::vector<Vector3d> ways;
    for (const int end : edges[v]) {
      const double length = edge_length(mesh, edges, corner.vertex, end, options.straight_rad);
      if (length < options.min_edge * mesh.size_m) continue;
      corner.edges_m += length;
      ways.push_back((mesh.vertices[end] - mesh.vertices[v]).normalized());
    }
    corner.edges = static_cast<int>(ways.size());
    if (is_corner(ways, options.straight_rad)) corners.push_back(corner);
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.edges_m > b.edges_m; });
  return corners;
}

// Moeller, Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
bool hides(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& eye,
           const Vector3d& way) {
  const Vector3d ab = b - a, ac = c - a, across = way.cross(ac);
  const double det = ab.dot(across);
  if (det == 0) return false;
  const Vector3d from = (eye - a) / det;
  const double u = from.dot(across);
  if (!(u >= 0 && u <= 1)) return false;
  const Vector3d turned = from.cross(ab);
  const double v = way.dot(turned);
  return v >= 0 && u + v <= 1 && ac.dot(turned) > 0;
}

// Faces at the vertex itself hide it only together with the others: a way into a closed body leaves
// it somewhere else.
bool is_visible(const Mesh& mesh, int vertex, const Vector3d& way) {
  const Vector3d& eye = mesh.vertices[vertex];
  return std::none_of(mesh.faces.begin(), mesh.faces.end(), [&](const Eigen::Vector3i& face) {
    if ((face.array() == vertex).any()) return false;
    const auto at = [&](int k) { return mesh.vertices[face[k]]; };
    return hides(at(0), at(1), at(2), eye, way);
  });
}

// Directions spread evenly over the sphere (Fibonacci's lattice).
std::vector<Vector3d> sphere(int count) {
  const double turn = pi * (3 - std::sqrt(5.0));
  std::vector<Vector3d> ways;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, across = std::sqrt(1 - z * z);
    ways.emplace_back(across * std::cos(i * turn), across * std::sin(i * turn), z);
  }
  return ways;
}

/// Half angle with which a cone about `normal` is right about most directions.
double best_cone(const std::vector<Vector3d>& ways, const std::vector<bool>& visible,
                 const Vector3d& normal) {
  std::vector<std::pair<double, int>> by_angle;  // angle, +1 for visible, -1 for hidden
  for (std::size_t i = 0; i < ways.size(); ++i)
    by_angle.push_back(
        {std::acos(std::clamp(ways[i].dot(normal), -1.0, 1.0)), visible[i] ? 1 : -1});
  std::sort(by_angle.begin(), by_angle.end());
  double cone = by_angle.front().first;
  int right = 0, most = 0;
  for (std::size_t i = 0; i < by_angle.size(); ++i) {
    right += by_angle[i].second;
    if (right <= most) continue;
    most = right;
    cone = i + 1 < by_angle.size() ? 0.5 * (by_angle[i].first + by_angle[i + 1].first) : pi;
  }
  return cone;
}

/// False when it is hidden from everywhere.
bool look_at_point(const Mesh& mesh, int vertex, const std::vector<Vector3d>& ways,
                   ObjectPoint& point) {
  std::vector<bool> visible;
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& way : ways) {
    visible.push_back(is_visible(mesh, vertex, way));
    if (visible.back()) sum += way;
  }
  const auto count = std::count(visible.begin(), visible.end(), true);
  if (count == 0) return false;
  constexpr double no_side = 1e-2;  // the rest of a lattice that is visible all round
  point.normal = sum.norm() > no_side * static_cast<double>(count) ? Vector3d(sum.normalized())
                                                                   : Vector3d::UnitZ();
  point.cone_rad = best_cone(ways, visible, point.normal);
  return true;
}

}  // namespace

void DetectableOptions::validate() const {
  require(sharp_rad > 0 && sharp_rad < pi, "sharp_rad", sharp_rad, "in (0, pi)");
  require(straight_rad > 0 && straight_rad < pi / 2, "straight_rad", straight_rad, "in (0, pi/2)");
  require(min_edge >= 0 && min_edge < 1, "min_edge", min_edge, "in [0, 1)");
  require(max_points > 0, "max_points", max_points, "positive");
  require(directions >= 10, "directions", directions, "at least 10");
}

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
  const std::vector<Vector3d> ways = sphere(options.directions);
  std::vector<DetectablePoint> points;
  for (const Corner& corner : corners_of(mesh, options)) {
    DetectablePoint found;
    found.point.id = static_cast<int>(points.size());
    found.point.position_m = mesh.vertices[corner.vertex];
    found.edges = corner.edges;
    found.edges_m = corner.edges_m;
    if (look_at_point(mesh, corner.vertex, ways, found.point)) points.push_back(found);
    if (static_cast<int>(points.size()) == options.max_points) break;
  }
  return points;
}

}  // namespace occ
