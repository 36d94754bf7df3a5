// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/internal/shadow.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/scene/view.hpp"

namespace occ::internal::formation {
namespace {

// Part of the polygon with side(p) >= 0 for a linear function `side` (Sutherland and Hodgman 1974).
template <typename Side>
Polygon clipped(const Polygon& polygon, const Side& side) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = side(a), at_b = side(b);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) kept.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return kept;
}

// Convex hull by Andrew's monotone chain, counter-clockwise.
Polygon convex_hull(Polygon points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  Polygon hull;
  for (const int pass : {0, 1}) {
    const std::size_t begin = hull.size();
    for (const Eigen::Vector2d& p : points) {
      while (hull.size() >= begin + 2 &&
             cross_2d(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // also the first point of the other pass
    if (pass == 0) std::reverse(points.begin(), points.end());
  }
  return hull;
}

std::array<Eigen::Vector3d, 8> corners(const Box& box) {
  std::array<Eigen::Vector3d, 8> all;
  for (std::size_t i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis)
      all[i][axis] = (i >> axis & 1) != 0 ? box.max_m[axis] : box.min_m[axis];
  return all;
}

constexpr int rim_points = 256;  // of a face's polygon

// Convex polygons with the area of the face. The scale compensates the area between a round rim and
// its chords.
std::vector<Polygon> face_polygons(const Lamp& lamp, const Face& face) {
  if (lamp.shape == LampShape::polygon) {
    std::vector<Polygon> triangles;
    for (const std::array<int, 3>& corner : lamp.face_triangles()) {
      Polygon& triangle = triangles.emplace_back();
      for (const int i : corner) triangle.push_back(lamp.corners_m[static_cast<std::size_t>(i)]);
    }
    return triangles;
  }
  Polygon polygon;
  for (const Eigen::Vector3d& point : rim_in_world(lamp, rim_points))
    polygon.emplace_back((point - face.centre).dot(face.x), (point - face.centre).dot(face.y));
  const double scale = std::sqrt(lamp.area_m2() / area(polygon));
  for (Eigen::Vector2d& p : polygon) p *= scale;
  return {polygon};
}

double total_area(const std::vector<Polygon>& pieces) {
  double sum = 0;
  for (const Polygon& piece : pieces) sum += area(piece);
  return sum;
}

}  // namespace

double area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += cross_2d(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * twice;
}

std::vector<Polygon> outside(const Polygon& polygon, const Polygon& hole) {
  std::vector<Polygon> pieces;
  Polygon rest = polygon;
  for (std::size_t i = 0; i < hole.size() && !rest.empty(); ++i) {
    const Eigen::Vector2d &a = hole[i], edge = hole[(i + 1) % hole.size()] - a;
    const auto inside = [&](const Eigen::Vector2d& p) { return cross_2d(edge, p - a); };
    Polygon piece = clipped(rest, [&](const Eigen::Vector2d& p) { return -inside(p); });
    if (area(piece) > 0) pieces.push_back(std::move(piece));
    rest = clipped(rest, inside);
  }
  return pieces;
}

Face::Face(const Lamp& lamp)
    : centre(lamp.centre_m),
      x(lamp.x_axis),
      y(lamp.normal.cross(lamp.x_axis)),
      normal(lamp.normal) {}

Polygon shadow(const Box& box, const Face& face, const Eigen::Vector3d& seen_from) {
  // Start of the considered range between the point (0) and the plane (1); avoids a division by 0.
  constexpr double min_fraction = 1e-9;
  const double height = (seen_from - face.centre).dot(face.normal);
  const std::array<Eigen::Vector3d, 8> all = corners(box);
  // Position of a corner between the point (0) and the plane (1).
  const auto fraction = [&](const Eigen::Vector3d& p) {
    return 1 - (p - face.centre).dot(face.normal) / height;
  };
  Polygon cast;
  const auto cast_point = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d hit = seen_from + (p - seen_from) / fraction(p) - face.centre;
    cast.emplace_back(hit.dot(face.x), hit.dot(face.y));
  };
  for (std::size_t i = 0; i < 8; ++i) {
    const double at = fraction(all[i]);
    if (at >= min_fraction && at <= 1) cast_point(all[i]);
    for (const std::size_t bit : {1u, 2u, 4u}) {
      if ((i & bit) != 0) continue;
      const double to = fraction(all[i | bit]);
      for (const double limit : {min_fraction, 1.0})
        if ((at < limit) != (to < limit))
          cast_point(all[i] + (limit - at) / (to - at) * (all[i | bit] - all[i]));
    }
  }
  return cast.size() < 3 ? Polygon() : convex_hull(cast);
}

Visible visible_part(const Lamp& lamp, const std::vector<Box>& boxes,
                     const Eigen::Vector3d& seen_from) {
  Visible visible;
  if (lamp.shape == LampShape::point) {
    if (hidden_by_box(boxes, lamp.centre_m, seen_from)) visible.share = 0;
    return visible;
  }
  if (!lamp.shows_lit_side(seen_from)) return visible;
  const Face face(lamp);
  std::vector<Polygon> pieces = face_polygons(lamp, face);
  const double whole = total_area(pieces);
  for (const Box& box : boxes) {
    const Polygon hole = shadow(box, face, seen_from);
    if (hole.empty()) continue;
    std::vector<Polygon> left;
    for (const Polygon& piece : pieces)
      for (Polygon& part : outside(piece, hole)) left.push_back(std::move(part));
    // If the shadow misses all pieces, they are not divided.
    if (total_area(left) < (1 - 1e-12) * total_area(pieces)) pieces = std::move(left);
  }
  constexpr double rounding = 1e-9;
  visible.share = total_area(pieces) / whole;
  if (visible.share > 1 - rounding) return {};
  if (visible.share > rounding)
    visible.pieces = std::move(pieces);
  else
    visible.share = 0;
  return visible;
}

}  // namespace occ::internal::formation
