// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_kinds.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Vector3d;

// Error of a size by the plane of other lamps: the normal of a disc is known to some hundredths of
// a radian, and lamps hang at other heights.
constexpr double plane_sigma = 0.1;
constexpr double tag_sigma = 0.5;   // likewise of a tag, which may be on a wall
constexpr double max_step = 1.25;   // of sizes in a plane; lamps that hang look larger
constexpr double min_cosine = 0.1;  // of a ray and the plane's normal

/// Size of a lamp in the plane of other lamps.
double size_in_plane(const LampShapeView& view, const Rigid3& cam_from_map,
                     const std::vector<MapLamp>& lamps) {
  Vector3d normal = Vector3d::Zero();
  for (const MapLamp& lamp : lamps)
    if (lamp.tag < 0) normal += lamp.normal;
  normal.normalize();
  std::vector<double> heights;
  for (const MapLamp& lamp : lamps)
    if (lamp.tag < 0) heights.push_back(normal.dot(lamp.position));
  const Rigid3 map_from_cam = cam_from_map.inverse();
  const double height = median(std::move(heights)) - normal.dot(map_from_cam.translation);
  const double cosine =
      std::max(min_cosine, std::abs(normal.dot(map_from_cam.rotation * view.bearing)));
  return std::abs(height) / (cosine * view.range);
}

}  // namespace

double aspect_of(const LampShapeView& view) {
  if (view.shape == LampShape::disc) return 1;
  return view.sides.maxCoeff() / view.sides.minCoeff();
}

double aspect_of(const Lamp& lamp) {
  if (lamp.shape != LampShape::rectangle) return 1;
  return lamp.size_m.maxCoeff() / lamp.size_m.minCoeff();
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
  const Vector3d normal = common_normal(views);
  LampGroups groups;
  groups.group_of.resize(views.size());
  for (const LampShapeView& view : views)
    groups.plane_size.push_back(
        1 / (std::max(min_cosine, std::abs(normal.dot(view.bearing))) * view.range));
  // In the order of their sizes, a lamp that is much larger than the last one of its kind begins a
  // new group.
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return groups.plane_size[a] < groups.plane_size[b];
  });
  std::vector<std::size_t> last;  // largest view of each group so far
  for (const std::size_t v : order) {
    const auto group = std::find_if(last.begin(), last.end(), [&](std::size_t other) {
      return (views[v].tag < 0) == (views[other].tag < 0) &&
             is_of_kind(views[v], views[other].shape, aspect_of(views[other])) &&
             !(by_plane && groups.plane_size[v] > max_step * groups.plane_size[other]);
    });
    groups.group_of[v] = static_cast<int>(group - last.begin());
    if (group == last.end())
      last.push_back(v);
    else
      *group = v;
  }
  groups.count = static_cast<int>(last.size());
  return groups;
}

std::vector<LampSize> sizes_of(const std::vector<LampShapeView>& views, const LampGroups& groups,
                               double spread) {
  std::vector<std::vector<double>> sizes(static_cast<std::size_t>(groups.count));
  std::vector<bool> of_tags(sizes.size(), false);
  for (std::size_t v = 0; v < groups.group_of.size(); ++v) {
    sizes[groups.group_of[v]].push_back(groups.plane_size[v]);
    of_tags[groups.group_of[v]] = views[v].tag >= 0;
  }
  std::size_t largest = 0;  // of lamps, if there are any
  for (std::size_t g = 1; g < sizes.size(); ++g)
    if (std::pair(!of_tags[g], sizes[g].size()) >
        std::pair(!of_tags[largest], sizes[largest].size()))
      largest = g;
  std::vector<LampSize> result;
  for (const int group : groups.group_of)
    if (static_cast<std::size_t>(group) == largest)
      result.push_back({1, spread});
    else
      result.push_back({median(sizes[group]) / median(sizes[largest]),
                        std::hypot(spread, of_tags[group] ? tag_sigma : plane_sigma)});
  return result;
}

LampSize size_of_further_lamp(const LampShapeView& view, const Rigid3& cam_from_map,
                              const std::vector<MapLamp>& lamps, double spread) {
  std::vector<const MapLamp*> similar;
  double smallest = infinity, largest = 0;
  for (const MapLamp& lamp : lamps) {
    if ((view.tag < 0) != (lamp.tag < 0) || !is_of_kind(view, lamp.shape, lamp.aspect)) continue;
    similar.push_back(&lamp);
    smallest = std::min(smallest, lamp.size);
    largest = std::max(largest, lamp.size);
  }
  if (!(largest < max_step * smallest) || similar.empty()) {  // several sizes, or none
    const double in_plane = size_in_plane(view, cam_from_map, lamps);
    const auto differs = [&](const MapLamp* lamp) {
      const double ratio = lamp->size / in_plane;
      return ratio > max_step || ratio < 1 / max_step;
    };
    similar.erase(std::remove_if(similar.begin(), similar.end(), differs), similar.end());
    if (similar.empty())
      return {in_plane, std::hypot(spread, view.tag < 0 ? plane_sigma : tag_sigma)};
  }
  std::vector<double> sizes, sigmas;
  for (const MapLamp* lamp : similar) {
    sizes.push_back(lamp->size);
    sigmas.push_back(lamp->size_sigma);
  }
  return {median(std::move(sizes)), std::max(spread, median(std::move(sigmas)))};
}

}  // namespace occ::internal::survey
