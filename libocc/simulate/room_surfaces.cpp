// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/room_surfaces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/scene/internal/lamp_polygon.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {

// Per side of a surface. Tests compare the light with a path tracer.
constexpr int tiles_per_side = 10, nodes_per_side = 17;

int axis_of(int face) { return face / 2; }
int u_of(int face) { return (axis_of(face) + 1) % 3; }
int v_of(int face) { return (axis_of(face) + 2) % 3; }

// Irradiance per radiosity that a polygon causes at a point on a surface with this normal. The
// whole polygon must be in front of the surface. Lambert's formula:
//     F = 1 / (2 pi) sum of beta_i cos(alpha_i).
double configuration_factor(const std::array<Eigen::Vector3d, 4>& polygon,
                            const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d a = polygon[i] - point, b = polygon[(i + 1) % 4] - point;
    const Eigen::Vector3d across = a.cross(b);
    const double sine = across.norm();
    if (sine > 0) sum += std::atan2(sine, a.dot(b)) * across.dot(normal) / sine;
  }
  return std::abs(sum) / (2 * pi);
}

// Centres of the cells of a grid over a polygon that are inside it; a finer grid for a thin star.
std::vector<Eigen::Vector3d> polygon_elements(const Lamp& lamp) {
  constexpr std::size_t enough = 12;
  const Face face(lamp);
  Eigen::Array2d low = Eigen::Array2d::Constant(infinity), high = -low;
  for (const Eigen::Vector2d& corner : lamp.corners_m) {
    low = low.min(corner.array());
    high = high.max(corner.array());
  }
  std::vector<Eigen::Vector3d> elements;
  for (int along = 7; elements.size() < enough && along < 200; along *= 3) {
    elements.clear();
    for (int i = 0; i < along; ++i)
      for (int j = 0; j < along; ++j) {
        const Eigen::Array2d share = Eigen::Array2d(i + 0.5, j + 0.5) / along;
        const Eigen::Vector2d at = low + (high - low) * share;
        if (internal::scene::contains(lamp.corners_m, at)) elements.push_back(face.point(at));
      }
  }
  if (elements.empty()) elements.push_back(lamp.centre_m);
  return elements;
}

// Points that represent equal parts of a lamp's face; for a disc, on rings of equal area.
std::vector<Eigen::Vector3d> lamp_elements(const Lamp& lamp) {
  if (lamp.shape == LampShape::point) return {lamp.centre_m};
  if (lamp.shape == LampShape::polygon) return polygon_elements(lamp);
  const Face face(lamp);
  std::vector<Eigen::Vector3d> elements;
  constexpr int rings = 3, around = 8, along = 5;
  if (lamp.shape == LampShape::disc) {
    for (int ring = 0; ring < rings; ++ring)
      for (int i = 0; i < around; ++i) {
        const double radius = lamp.radius_m * std::sqrt((ring + 0.5) / rings);
        const double angle = 2 * pi * (i + 0.5 * (ring % 2)) / around;
        elements.push_back(face.point({radius * std::cos(angle), radius * std::sin(angle)}));
      }
    return elements;
  }
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < along; ++j)
      elements.push_back(face.point({((i + 0.5) / along - 0.5) * lamp.size_m.x(),
                                     ((j + 0.5) / along - 0.5) * lamp.size_m.y()}));
  return elements;
}

// Start of the i-th of n steps along a side. Steps are short near edges, where light changes most.
double graded(int i, int n) { return 0.5 - 0.5 * std::cos(pi * i / n); }

// Position of a node along a side. Light by the adjacent surface is undefined on the edge itself.
double node(int i) {
  constexpr double off_edge = 1e-4;
  return std::clamp(graded(i, nodes_per_side - 1), off_edge, 1 - off_edge);
}

// Interval between two nodes, and the position in it from 0 to 1.
struct NodeInterval {
  int low;
  double fraction;
};
NodeInterval interval_at(double position) {
  const double inside = std::clamp(position, node(0), node(nodes_per_side - 1));
  const double steps = std::acos(1 - 2 * inside) / pi * (nodes_per_side - 1);
  const int low = std::clamp(static_cast<int>(steps), 0, nodes_per_side - 2);
  return {low, (inside - node(low)) / (node(low + 1) - node(low))};
}

}  // namespace

RoomSurfaces::RoomSurfaces(const Scene& scene, const std::vector<double>& lamp_light)
    : room_(*scene.room) {
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const Lamp& lamp = scene.lamps[i];
    const std::vector<Eigen::Vector3d> elements = lamp_elements(lamp);
    const double power_w =
        lamp_light[i] * lamp.mean_light() * lamp.power_w / static_cast<double>(elements.size());
    emissions_.emplace_back(lamp);
    for (const Eigen::Vector3d& element : elements)
      elements_.push_back({element, lamp.normal, i, power_w});
  }
}

Eigen::Vector3d RoomSurfaces::normal(int face) const {
  return (face % 2 == 0 ? 1 : -1) * Eigen::Vector3d::Unit(axis_of(face));
}

RoomSurfaces::Hit RoomSurfaces::hit(const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& direction) const {
  Hit hit;
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const bool upper = direction[axis] > 0;
    const double way = ((upper ? room_.size_m[axis] : 0) - from[axis]) / direction[axis];
    if (!(way < nearest)) continue;
    nearest = way;
    hit.face = 2 * axis + (upper ? 1 : 0);
  }
  hit.point = from + nearest * direction;
  return hit;
}

double RoomSurfaces::direct(int face, const Eigen::Vector3d& point) const {
  double sum = 0;
  const Eigen::Vector3d n = normal(face);
  for (const Element& element : elements_) {
    const Eigen::Vector3d way = point - element.at;
    const double distance = way.norm();
    const double emitted = way.dot(element.normal) / distance;
    const double arriving = -way.dot(n) / distance;
    if (emitted > 0 && arriving > 0)
      sum += emissions_[element.lamp].aperture_power(element.power_w, way, emitted, arriving,
                                                     distance, 1);
  }
  return sum;
}

double RoomSurfaces::max_direct() const {
  constexpr int samples = 24;
  double largest = 0;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i <= samples; ++i)
      for (int j = 0; j <= samples; ++j)
        largest = std::max(largest, direct(face, at(face, static_cast<double>(i) / samples,
                                                    static_cast<double>(j) / samples)));
  for (const Element& element : elements_) {  // a lamp may face a near surface
    const Hit ahead = hit(element.at, element.normal);
    largest = std::max(largest, direct(ahead.face, ahead.point));
    for (int face = 0; face < 6; ++face) {
      Eigen::Vector3d foot = element.at;
      foot[axis_of(face)] = face % 2 == 0 ? 0 : room_.size_m[axis_of(face)];
      largest = std::max(largest, direct(face, foot));
    }
  }
  return largest;
}

Eigen::Vector3d RoomSurfaces::at(int face, double u, double v) const {
  Eigen::Vector3d point;
  point[axis_of(face)] = face % 2 == 0 ? 0 : room_.size_m[axis_of(face)];
  point[u_of(face)] = u * room_.size_m[u_of(face)];
  point[v_of(face)] = v * room_.size_m[v_of(face)];
  return point;
}

std::vector<RoomSurfaces::Tile> RoomSurfaces::tiles() const {
  std::vector<Tile> all;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i < tiles_per_side; ++i)
      for (int j = 0; j < tiles_per_side; ++j) {
        const double u0 = graded(i, tiles_per_side), u1 = graded(i + 1, tiles_per_side);
        const double v0 = graded(j, tiles_per_side), v1 = graded(j + 1, tiles_per_side);
        all.push_back({face,
                       at(face, 0.5 * (u0 + u1), 0.5 * (v0 + v1)),
                       {at(face, u0, v0), at(face, u1, v0), at(face, u1, v1), at(face, u0, v1)}});
      }
  return all;
}

double RoomSurfaces::from_tiles(const std::vector<Tile>& tiles, int face,
                                const Eigen::Vector3d& point) const {
  double sum = 0;
  const Eigen::Vector3d n = normal(face);
  for (const Tile& tile : tiles)
    if (tile.face != face) sum += tile.radiosity * configuration_factor(tile.corners, point, n);
  return sum;
}

void RoomSurfaces::solve_interreflection() {
  constexpr double converged = 1e-6;  // relative change per iteration
  std::vector<Tile> all = tiles();
  const std::size_t count = all.size();
  std::vector<double> first(count), factors(count * count);
  for (std::size_t i = 0; i < count; ++i) {
    first[i] = direct(all[i].face, all[i].centre);
    all[i].radiosity = reflectance() * first[i];
    for (std::size_t j = 0; j < count; ++j)
      if (all[j].face != all[i].face)
        factors[i * count + j] =
            configuration_factor(all[j].corners, all[i].centre, normal(all[i].face));
  }
  for (double change = 1; change > converged;) {  // decreases by the reflectance per iteration
    change = 0;
    for (std::size_t i = 0; i < count; ++i) {
      double light = first[i];
      for (std::size_t j = 0; j < count; ++j) light += factors[i * count + j] * all[j].radiosity;
      const double next = reflectance() * light;
      change = std::max(change, std::abs(next - all[i].radiosity) / std::max(next, 1e-300));
      all[i].radiosity = next;
    }
  }
  for (int face = 0; face < 6; ++face) {
    std::vector<double>& nodes = nodes_[face];
    for (int i = 0; i < nodes_per_side; ++i)
      for (int j = 0; j < nodes_per_side; ++j)
        nodes.push_back(from_tiles(all, face, at(face, node(i), node(j))));
  }
}

double RoomSurfaces::indirect(int face, const Eigen::Vector3d& point) const {
  const std::vector<double>& nodes = nodes_[face];
  if (nodes.empty()) return 0;
  const NodeInterval u = interval_at(point[u_of(face)] / room_.size_m[u_of(face)]);
  const NodeInterval v = interval_at(point[v_of(face)] / room_.size_m[v_of(face)]);
  const auto row = [&](int i) {
    const double* from = &nodes[i * nodes_per_side + v.low];
    return from[0] + v.fraction * (from[1] - from[0]);
  };
  return row(u.low) + u.fraction * (row(u.low + 1) - row(u.low));
}

}  // namespace occ::internal::simulate
