// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/lamp_polygon.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include "libocc/core/internal/area_moments.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::scene {
namespace {

/// Twice the area of a triangle, positive if it turns counter-clockwise.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return cross_2d(b - a, c - a);
}

bool is_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& point) {
  return (point - a).dot(b - a) >= 0 && (point - b).dot(a - b) >= 0;
}

/// True if the segments have a point in common.
bool meet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
          const Eigen::Vector2d& d) {
  const double at_c = turn(a, b, c), at_d = turn(a, b, d), at_a = turn(c, d, a),
               at_b = turn(c, d, b);
  return (at_c * at_d < 0 && at_a * at_b < 0) || (at_c == 0 && is_between(a, b, c)) ||
         (at_d == 0 && is_between(a, b, d)) || (at_a == 0 && is_between(c, d, a)) ||
         (at_b == 0 && is_between(c, d, b));
}

std::string side_name(std::size_t i, std::size_t count) {
  return std::to_string(i + 1) + "-" + std::to_string((i + 1) % count + 1);
}

/// Fault of the outline, as "got ..." of an error; empty if there is none.
std::string fault_of(const Corners& corners) {
  const std::size_t n = corners.size();
  const auto at = [&](std::size_t i) -> const Eigen::Vector2d& { return corners[i % n]; };
  for (std::size_t i = 0; i < n; ++i) {
    if (at(i) == at(i + 1)) return "a side " + side_name(i, n) + " of no length";
    const Eigen::Vector2d back = at(i) - at(i + 1), ahead = at(i + 2) - at(i + 1);
    if (cross_2d(back, ahead) == 0 && back.dot(ahead) > 0)
      return "a side " + side_name((i + 1) % n, n) + " that runs back along side " +
             side_name(i, n);
    for (std::size_t j = i + 2; j < n && j < i + n - 1; ++j)
      if (meet(at(i), at(i + 1), at(j), at(j + 1)))
        return "sides " + side_name(i, n) + " and " + side_name(j, n) + " that meet";
  }
  return "";
}

bool is_inside(const std::array<Eigen::Vector2d, 3>& triangle, const Eigen::Vector2d& point) {
  for (std::size_t i = 0; i < 3; ++i)
    if (turn(triangle[i], triangle[(i + 1) % 3], point) < 0) return false;
  return true;
}

}  // namespace

void validate_polygon(Lamp& lamp) {
  Corners& corners = lamp.corners_m;
  const std::string name = "lamp " + std::to_string(lamp.id) + ": corners_m";
  if (corners.size() < 3)
    require(false, name, std::to_string(corners.size()) + " corners", "at least three corners");
  for (const Eigen::Vector2d& corner : corners)
    if (!corner.allFinite()) require(false, name, corner.transpose(), "finite");
  const std::string fault = fault_of(corners);
  if (!fault.empty())
    require(false, name, fault, "the corners of a polygon that does not cross or touch itself");
  core::OutlineMoments moments = core::outline_moments(corners);
  if (moments.area < 0) {
    std::reverse(corners.begin(), corners.end());
    moments = core::outline_moments(corners);
  }
  double reach_m = 0;
  for (const Eigen::Vector2d& corner : corners)
    reach_m = std::max(reach_m, (corner - moments.centroid).norm());
  constexpr double rounding = 1e-12;
  if (!(moments.area > rounding * reach_m * reach_m))
    require(false, name, std::to_string(moments.area) + " m^2", "around an area");
  if (moments.centroid.norm() <= rounding * reach_m) return;
  const Eigen::Vector3d y_axis = lamp.normal.cross(lamp.x_axis);
  lamp.centre_m += moments.centroid.x() * lamp.x_axis + moments.centroid.y() * y_axis;
  for (Eigen::Vector2d& corner : corners) corner -= moments.centroid;
}

bool is_convex(const Corners& corners) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i)
    if (turn(corners[i], corners[(i + 1) % n], corners[(i + 2) % n]) < 0) return false;
  return true;
}

bool contains(const Corners& corners, const Eigen::Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
  }
  return inside;
}

std::vector<std::array<int, 3>> triangles_of(const Corners& corners) {
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> left(corners.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = static_cast<int>(i);
  const auto at = [&](int i) -> const Eigen::Vector2d& {
    return corners[static_cast<std::size_t>(i)];
  };
  while (left.size() > 3) {
    const std::size_t n = left.size();
    std::size_t ear = n;
    double fullest = 0;  // sine of the corner's angle
    for (std::size_t i = 0; i < n; ++i) {
      const int before = left[(i + n - 1) % n], here = left[i], after = left[(i + 1) % n];
      const std::array<Eigen::Vector2d, 3> triangle = {at(before), at(here), at(after)};
      const double area = turn(triangle[0], triangle[1], triangle[2]);
      const double sine =
          area / ((triangle[1] - triangle[0]).norm() * (triangle[2] - triangle[1]).norm());
      const bool is_free = std::none_of(left.begin(), left.end(), [&](int k) {
        return k != before && k != here && k != after && is_inside(triangle, at(k));
      });
      if (!is_free || !(sine > fullest)) continue;
      ear = i;
      fullest = sine;
    }
    if (ear == n) break;  // what is left lies on a line
    triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  if (left.size() == 3) triangles.push_back({left[0], left[1], left[2]});
  return triangles;
}

}  // namespace occ::internal::scene
