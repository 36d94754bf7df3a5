// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/world_frame.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "libocc/core/math.hpp"

namespace occ::internal::survey {

using Eigen::Vector3d;

Similarity world_frame(const LampMap& map, const std::vector<int>& order) {
  Vector3d down = Vector3d::Zero();
  for (const int lamp : order) down += map.lamps[lamp].normal;
  const Vector3d& first = map.lamps[order[0]].position;
  Vector3d farthest = first;
  for (const int lamp : order)
    if ((map.lamps[lamp].position - first).norm() > (farthest - first).norm())
      farthest = map.lamps[lamp].position;
  const Vector3d z = -down.normalized();
  Vector3d x = farthest - first;
  x -= z * z.dot(x);
  x = x.norm() > 0 ? Vector3d(x.normalized()) : Vector3d(z.unitOrthogonal());
  Similarity frame;
  frame.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  frame.scale = 1 / (farthest - first).norm();
  return frame;
}

Vector3d world_origin(const LampMap& map, const std::vector<int>& order) {
  Vector3d mean = Vector3d::Zero();
  for (const int lamp : order) mean += map.lamps[lamp].position / static_cast<double>(order.size());
  double lowest = infinity;
  for (const PlacedPicture& placed : map.placed)
    lowest = std::min(lowest, placed.cam_from_map.origin_in_source().z());
  return {mean.x(), mean.y(), lowest};
}

}  // namespace occ::internal::survey
