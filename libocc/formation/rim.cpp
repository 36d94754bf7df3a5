// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/rim.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/internal/lame_curve.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {

using namespace internal::formation;
namespace {

using Jacobian26 = Eigen::Matrix<double, 2, 6>;
using Jacobian23 = Eigen::Matrix<double, 2, 3>;

// d (R p + t) / d pose perturbation.
Eigen::Matrix<double, 3, 6> point_jacobian(const Eigen::Vector3d& point_in_cam) {
  Eigen::Matrix<double, 3, 6> j;
  j << -skew(point_in_cam), Eigen::Matrix3d::Identity();
  return j;
}

// Half sides of a rectangle or Lame curve as vectors in the world; x cross y is along the normal.
struct HalfSides {
  Eigen::Vector3d x, y;
};

HalfSides half_sides(const Lamp& lamp) {
  return {lamp.size_m.x() / 2 * lamp.x_axis, lamp.size_m.y() / 2 * lamp.normal.cross(lamp.x_axis)};
}

std::array<Eigen::Vector3d, 4> rectangle_corners(const Lamp& lamp) {
  const HalfSides half = half_sides(lamp);
  const Eigen::Vector3d& c = lamp.centre_m;
  return {c - half.x - half.y, c + half.x - half.y, c + half.x + half.y, c - half.x + half.y};
}

std::vector<Eigen::Vector3d> polygon_corners(const Lamp& lamp) {
  const Face face(lamp);
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& corner : lamp.corners_m) corners.push_back(face.point(corner));
  return corners;
}

// Orthogonal radii of a disc; their cross product is along the normal.
std::array<Eigen::Vector3d, 2> radii(const Lamp& lamp) {
  const Eigen::Vector3d u = lamp.normal.unitOrthogonal();
  return {lamp.radius_m * u, lamp.radius_m * lamp.normal.cross(u)};
}

void append_rectangle_rim(const Lamp& lamp, int count, std::vector<Eigen::Vector3d>& rim) {
  const double share = lamp.size_m.x() / (lamp.size_m.x() + lamp.size_m.y());
  const int half = count / 2;
  const int along = std::clamp(static_cast<int>(std::lround(half * share)), 1, half - 1);
  const std::array<int, 4> steps = {along + count % 2, half - along, along, half - along};
  const std::array<Eigen::Vector3d, 4> corner = rectangle_corners(lamp);
  for (std::size_t side = 0; side < 4; ++side) {
    const Eigen::Vector3d edge = corner[(side + 1) % 4] - corner[side];
    for (int i = 0; i < steps[side]; ++i) rim.push_back(corner[side] + edge * i / steps[side]);
  }
}

// At least one point on each side, which may be more than `count` in all.
void append_polygon_rim(const Lamp& lamp, int count, std::vector<Eigen::Vector3d>& rim) {
  const std::vector<Eigen::Vector3d> corner = polygon_corners(lamp);
  double perimeter = 0;
  const auto edge = [&](std::size_t i) -> Eigen::Vector3d {
    return corner[(i + 1) % corner.size()] - corner[i];
  };
  for (std::size_t i = 0; i < corner.size(); ++i) perimeter += edge(i).norm();
  for (std::size_t i = 0; i < corner.size(); ++i) {
    const int steps =
        std::max(1, static_cast<int>(std::lround(count * edge(i).norm() / perimeter)));
    for (int k = 0; k < steps; ++k) rim.push_back(corner[i] + edge(i) * k / steps);
  }
}

// Node of a quadrature along the rim: the point, and the tangent times the node's weight.
struct RimNode {
  Eigen::Vector3d point, step;
};

template <std::size_t count>
using RimNodes = std::array<RimNode, count>;

// Trapezoid rule, which converges spectrally for the smooth image of a circle.
RimNodes<16> disc_nodes(const Lamp& lamp) {
  const auto [u, v] = radii(lamp);
  RimNodes<16> nodes;
  const auto count = static_cast<double>(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double angle = 2 * pi * static_cast<double>(i) / count;
    nodes[i].point = lamp.centre_m + std::cos(angle) * u + std::sin(angle) * v;
    nodes[i].step = 2 * pi / count * (std::cos(angle) * v - std::sin(angle) * u);
  }
  return nodes;
}

// Gauss-Legendre rule with four nodes on each side between the corners.
template <typename Corners, typename Nodes>
void set_side_nodes(const Corners& corner, Nodes& nodes) {
  constexpr std::array<double, 4> at = {0.06943184420297371239, 0.33000947820757186760,
                                        0.66999052179242813240, 0.93056815579702628761};
  constexpr std::array<double, 4> weight = {0.17392742256872692869, 0.32607257743127307131,
                                            0.32607257743127307131, 0.17392742256872692869};
  for (std::size_t side = 0; side < corner.size(); ++side) {
    const Eigen::Vector3d edge = corner[(side + 1) % corner.size()] - corner[side];
    for (std::size_t i = 0; i < 4; ++i) {
      nodes[4 * side + i] = {corner[side] + at[i] * edge, weight[i] * edge};
    }
  }
}

RimNodes<16> rectangle_nodes(const Lamp& lamp) {
  RimNodes<16> nodes;
  set_side_nodes(rectangle_corners(lamp), nodes);
  return nodes;
}

std::vector<RimNode> polygon_nodes(const Lamp& lamp) {
  std::vector<RimNode> nodes(4 * lamp.corners_m.size());
  set_side_nodes(polygon_corners(lamp), nodes);
  return nodes;
}

RimNodes<128> curve_nodes(const Lamp& lamp) {
  const HalfSides half = half_sides(lamp);
  RimNodes<128> nodes;
  const auto curve = lame_nodes(lamp.exponent);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].point = lamp.centre_m + curve[i].at.x() * half.x + curve[i].at.y() * half.y;
    nodes[i].step = curve[i].tangent.x() * half.x + curve[i].tangent.y() * half.y;
  }
  return nodes;
}

// Containers for one value of each node.
template <typename T, std::size_t count>
std::array<T, count> for_each_of(const std::array<RimNode, count>&) {
  return {};
}
template <typename T>
std::vector<T> for_each_of(const std::vector<RimNode>& nodes) {
  return std::vector<T>(nodes.size());
}

// Centroid of the image inside the rim by Green's theorem. Its derivative is the flux of the rim's
// motion: (1/A) closed integral of (p - mean) dp x p'.
template <typename Nodes>
std::optional<Eigen::Vector2d> area_centroid(const Nodes& nodes, const Rigid3& cam_from_world,
                                             const Camera& camera, Jacobian26* jacobian) {
  const std::size_t node_count = nodes.size();
  auto px = for_each_of<Eigen::Vector2d>(nodes), step = px;
  auto moves = for_each_of<Jacobian26>(nodes);
  for (std::size_t i = 0; i < node_count; ++i) {
    Jacobian23 d_point;
    const Eigen::Vector3d point_in_cam = cam_from_world * nodes[i].point;
    const std::optional<Eigen::Vector2d> pixel = camera.project(point_in_cam, &d_point);
    if (!pixel) return std::nullopt;
    px[i] = i == 0 ? *pixel : px[0] + camera.difference_px(*pixel, px[0]);
    step[i] = d_point * (cam_from_world.rotation * nodes[i].step);
    if (jacobian) moves[i] = d_point * point_jacobian(point_in_cam);
  }
  const Eigen::Vector2d reference = px[0];  // avoids cancellation for a small image far from (0, 0)
  double area = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < node_count; ++i) {
    const double swept = cross_2d(px[i] - reference, step[i]);
    area += swept / 2;
    moment += swept / 3 * (px[i] - reference);
  }
  const Eigen::Vector2d mean = reference + moment / area;
  if (jacobian) {
    jacobian->setZero();
    for (std::size_t i = 0; i < node_count; ++i) {
      const Eigen::Matrix<double, 1, 6> flux =
          step[i].y() * moves[i].row(0) - step[i].x() * moves[i].row(1);
      *jacobian += (px[i] - mean) / area * flux;
    }
  }
  return mean;
}

// d (x, y) of disc_image_centre / d pose perturbation.
Jacobian26 disc_image_centre_jacobian(const Eigen::Vector3d& c, const Eigen::Vector3d& n,
                                      double radius_m, const Eigen::Vector2d& centre) {
  const double r2 = radius_m * radius_m;
  const double below = c.z() * c.z() - r2 * (1 - n.z() * n.z());
  Jacobian23 d_centre, d_normal;
  d_centre << c.z() * Eigen::Matrix2d::Identity(), c.head<2>() - 2 * c.z() * centre;
  d_normal << r2 * n.z() * Eigen::Matrix2d::Identity(), r2 * (n.head<2>() - 2 * n.z() * centre);
  Jacobian26 j;
  j << d_centre * -skew(c) + d_normal * -skew(n), d_centre;
  return j / below;
}

std::optional<Eigen::Vector2d> ellipse_centre(const Lamp& lamp, const Rigid3& cam_from_world,
                                              const Camera& camera, Jacobian26* jacobian) {
  const Eigen::Vector3d c = cam_from_world * lamp.centre_m;
  const Eigen::Vector3d n = cam_from_world.rotation * lamp.normal;
  const double depth_reach = lamp.radius_m * std::sqrt(std::max(0.0, 1 - n.z() * n.z()));
  if (!(c.z() > depth_reach)) return std::nullopt;
  const Eigen::Vector3d direction = disc_image_centre(c, n, lamp.radius_m);
  Jacobian23 d_direction;
  const std::optional<Eigen::Vector2d> px =
      camera.project(direction, jacobian ? &d_direction : nullptr);
  if (px && jacobian) {
    *jacobian = d_direction.leftCols<2>() *
                disc_image_centre_jacobian(c, n, lamp.radius_m, direction.head<2>());
  }
  return px;
}

std::optional<Eigen::Vector2d> project_point(const Eigen::Vector3d& point_in_world,
                                             const Rigid3& cam_from_world, const Camera& camera,
                                             Jacobian26* jacobian) {
  const Eigen::Vector3d point_in_cam = cam_from_world * point_in_world;
  Jacobian23 d_point;
  const std::optional<Eigen::Vector2d> px =
      camera.project(point_in_cam, jacobian ? &d_point : nullptr);
  if (px && jacobian) *jacobian = d_point * point_jacobian(point_in_cam);
  return px;
}

bool is_undistorted_pinhole(const Camera& camera) {
  if (!camera.is_pinhole()) return false;
  const std::vector<double>& k = camera.distortion();
  return std::all_of(k.begin(), k.end(), [](double c) { return c == 0; });
}

}  // namespace

std::vector<Eigen::Vector3d> rim_in_world(const Lamp& lamp, int count) {
  require(count >= 8, "count", count, "at least 8");
  std::vector<Eigen::Vector3d> rim;
  if (lamp.shape == LampShape::point) return rim;
  rim.reserve(static_cast<std::size_t>(count));
  if (lamp.shape == LampShape::rectangle) {
    append_rectangle_rim(lamp, count, rim);
    return rim;
  }
  if (lamp.shape == LampShape::polygon) {
    append_polygon_rim(lamp, count, rim);
    return rim;
  }
  if (lamp.shape == LampShape::lame) {
    const HalfSides half = half_sides(lamp);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d at = lame_at_angle(lamp.exponent, 2 * pi * i / count);
      rim.push_back(lamp.centre_m + at.x() * half.x + at.y() * half.y);
    }
    return rim;
  }
  const auto [u, v] = radii(lamp);
  const double step_cos = std::cos(2 * pi / count), step_sin = std::sin(2 * pi / count);
  double c = 1, s = 0;  // rotated from point to point
  for (int i = 0; i < count; ++i) {
    rim.push_back(lamp.centre_m + c * u + s * v);
    const double next = step_cos * c - step_sin * s;
    s = step_sin * c + step_cos * s;
    c = next;
  }
  return rim;
}

std::optional<std::vector<Eigen::Vector2d>> project_rim(const Lamp& lamp,
                                                        const Rigid3& cam_from_world,
                                                        const Camera& camera, int count) {
  std::vector<Eigen::Vector3d> rim = rim_in_world(lamp, count);
  if (!lamp.shows_lit_side(cam_from_world.origin_in_source())) return std::nullopt;
  if (rim.empty()) rim.push_back(lamp.centre_m);
  std::vector<Eigen::Vector2d> pixels;
  pixels.reserve(rim.size());
  for (const Eigen::Vector3d& point : rim) {
    const std::optional<Eigen::Vector2d> px = camera.project(cam_from_world * point);
    if (!px) return std::nullopt;
    pixels.push_back(*px);
  }
  return pixels;
}

Eigen::Vector3d disc_image_centre(const Eigen::Vector3d& centre_in_cam,
                                  const Eigen::Vector3d& normal_in_cam, double radius_m) {
  const Eigen::Vector3d& c = centre_in_cam;
  const Eigen::Vector3d& n = normal_in_cam;
  const double r2 = radius_m * radius_m;
  const double below = c.z() * c.z() - r2 * (1 - n.z() * n.z());
  return {(c.x() * c.z() + r2 * n.z() * n.x()) / below,
          (c.y() * c.z() + r2 * n.z() * n.y()) / below, 1};
}

std::optional<Eigen::Vector2d> project_lamp_centre(const Lamp& lamp, const Rigid3& cam_from_world,
                                                   const Camera& camera, Jacobian26* jacobian) {
  if (!lamp.shows_lit_side(cam_from_world.origin_in_source())) return std::nullopt;
  switch (lamp.shape) {
    case LampShape::point:
      return project_point(lamp.centre_m, cam_from_world, camera, jacobian);
    case LampShape::rectangle:
      return area_centroid(rectangle_nodes(lamp), cam_from_world, camera, jacobian);
    case LampShape::polygon:
      return area_centroid(polygon_nodes(lamp), cam_from_world, camera, jacobian);
    case LampShape::lame:
      return area_centroid(curve_nodes(lamp), cam_from_world, camera, jacobian);
    case LampShape::disc:
      break;
  }
  if (is_undistorted_pinhole(camera)) {
    return ellipse_centre(lamp, cam_from_world, camera, jacobian);
  }
  return area_centroid(disc_nodes(lamp), cam_from_world, camera, jacobian);
}

}  // namespace occ
