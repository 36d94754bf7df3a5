// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_kinds.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Vector3d;

// Error of a size by the plane of other lamps: the normal of a disc is known to some hundredths of
// a radian, and lamps hang at other heights.
constexpr double plane_sigma = 0.1;
constexpr double max_step = 1.25;   // of sizes in a plane; lamps that hang look larger
constexpr double min_cosine = 0.1;  // of a ray and the plane's normal

}  // namespace

double aspect_of(const LampShapeView& view) {
  if (view.shape == LampShape::disc) return 1;
  return view.sides.maxCoeff() / view.sides.minCoeff();
}

Vector3d long_side(const LampShapeView& view) {
  if (view.shape == LampShape::disc) return Vector3d::Zero();
  return view.sides.x() > view.sides.y() ? view.x_axis : view.normals[0].cross(view.x_axis);
}

Vector3d long_side(const Lamp& lamp) {
  if (lamp.shape != LampShape::rectangle) return Vector3d::Zero();
  return lamp.size_m.x() > lamp.size_m.y() ? lamp.x_axis : lamp.normal.cross(lamp.x_axis);
}

bool is_of_kind(const LampShapeView& view, LampShape shape, double aspect) {
  const double ratio = aspect_of(view) / aspect;
  return view.shape == shape && ratio < max_aspect_ratio && ratio > 1 / max_aspect_ratio;
}

LampGroups groups_of(const std::vector<LampShapeView>& views, bool by_plane) {
  std::vector<Vector3d> normals;
  for (const LampShapeView& view : views)
    normals.insert(normals.end(), view.normals.begin(), view.normals.end());
  const Vector3d normal = consensus_direction(normals);
  LampGroups groups;
  groups.group_of.assign(views.size(), -1);
  for (const LampShapeView& view : views)
    groups.plane_size.push_back(
        1 / (std::max(min_cosine, std::abs(normal.dot(view.bearing))) * view.range));
  // In the order of their sizes, lamps of a kind make a new group at each step.
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return groups.plane_size[a] < groups.plane_size[b];
  });
  std::vector<std::size_t> last;  // view of each group
  for (const std::size_t v : order) {
    for (int g = 0; g < groups.count; ++g) {
      const LampShapeView& other = views[last[g]];
      if (!is_of_kind(views[v], other.shape, aspect_of(other)) ||
          (by_plane && groups.plane_size[v] > max_step * groups.plane_size[last[g]]))
        continue;
      groups.group_of[v] = g;
      last[g] = v;
    }
    if (groups.group_of[v] >= 0) continue;
    groups.group_of[v] = groups.count++;
    last.push_back(v);
  }
  return groups;
}

std::vector<LampSize> sizes_of(const LampGroups& groups, double spread) {
  std::vector<std::vector<double>> sizes(static_cast<std::size_t>(groups.count));
  for (std::size_t v = 0; v < groups.group_of.size(); ++v)
    sizes[groups.group_of[v]].push_back(groups.plane_size[v]);
  const auto largest = std::max_element(
      sizes.begin(), sizes.end(), [](const std::vector<double>& a, const std::vector<double>& b) {
        return a.size() < b.size();
      });
  std::vector<LampSize> result;
  for (const int group : groups.group_of)
    if (&sizes[group] == &*largest)
      result.push_back({1, spread});
    else
      result.push_back({median(sizes[group]) / median(*largest), std::hypot(spread, plane_sigma)});
  return result;
}

LampSize size_of_further_lamp(const LampShapeView& view, const Rigid3& cam_from_map,
                              const std::vector<MapLamp>& lamps, double spread) {
  std::vector<double> sizes, sigmas, heights;
  Vector3d normal = Vector3d::Zero();
  for (const MapLamp& lamp : lamps) normal += lamp.normal;
  normal.normalize();
  for (const MapLamp& lamp : lamps) heights.push_back(normal.dot(lamp.position));
  const Rigid3 map_from_cam = cam_from_map.inverse();
  const double height = median(heights) - normal.dot(map_from_cam.translation);
  const double cosine =
      std::max(min_cosine, std::abs(normal.dot(map_from_cam.rotation * view.bearing)));
  const double in_plane = std::abs(height) / (cosine * view.range);
  double smallest = infinity, largest = 0;
  for (const MapLamp& lamp : lamps) {
    if (!is_of_kind(view, lamp.shape, lamp.aspect)) continue;
    smallest = std::min(smallest, lamp.size);
    largest = std::max(largest, lamp.size);
  }
  const bool has_one_size = largest < max_step * smallest;
  for (const MapLamp& lamp : lamps) {
    const double ratio = lamp.size / in_plane;
    if (!is_of_kind(view, lamp.shape, lamp.aspect) ||
        (!has_one_size && (ratio > max_step || ratio < 1 / max_step)))
      continue;
    sizes.push_back(lamp.size);
    sigmas.push_back(lamp.size_sigma);
  }
  if (!sizes.empty()) return {median(sizes), std::max(spread, median(sigmas))};
  return {in_plane, std::hypot(spread, plane_sigma)};
}

}  // namespace occ::internal::survey
