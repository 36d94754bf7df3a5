// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {

constexpr int box_rim_points = 64;

// True if the point is inside the closed polygon.
bool surrounds(const std::vector<Eigen::Vector2d>& rim, const Eigen::Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Eigen::Vector2d a = rim[i] - point, b = rim[(i + 1) % rim.size()] - point;
    if ((a.y() > 0) == (b.y() > 0)) continue;
    if (a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y()) > 0) inside = !inside;
  }
  return inside;
}

// True if the segment has a point in the image. Clips it at the borders one after the other (Liang
// and Barsky, "A new concept and method for line clipping", ACM Trans. Graphics 3(1), 1984).
bool meets_image(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Camera& camera) {
  const Eigen::Vector2d low(-0.5, -0.5), high(camera.width() - 0.5, camera.height() - 0.5);
  double begin = 0, end = 1;  // part of the segment that is left
  for (int axis = 0; axis < 2; ++axis) {
    const double way = b[axis] - a[axis];
    if (way == 0) {
      if (a[axis] < low[axis] || a[axis] > high[axis]) return false;
      continue;
    }
    const double to_low = (low[axis] - a[axis]) / way, to_high = (high[axis] - a[axis]) / way;
    begin = std::max(begin, std::min(to_low, to_high));
    end = std::min(end, std::max(to_low, to_high));
  }
  return begin <= end;
}

// True if a part of the polygon lies in the image. If no side meets the image, it is inside of the
// polygon with all of its points or outside.
bool is_in_view(const std::vector<Eigen::Vector2d>& rim, const Camera& camera) {
  for (std::size_t i = 0; i < rim.size(); ++i)
    if (meets_image(rim[i], rim[(i + 1) % rim.size()], camera)) return true;
  return surrounds(rim, Eigen::Vector2d::Zero());
}

std::optional<std::vector<Eigen::Vector2d>> projected_rim(const Lamp& lamp, const Motion& motion,
                                                          const Camera& camera) {
  if (!motion.rolls()) return project_rim(lamp, motion.still_pose(), camera, box_rim_points);
  std::vector<Eigen::Vector3d> rim = rim_in_world(lamp, box_rim_points);
  if (rim.empty()) rim.push_back(lamp.centre_m);
  std::vector<Eigen::Vector2d> px;
  for (const Eigen::Vector3d& point : rim) {
    const auto seen = motion.seen(point, camera);
    if (!seen || !lamp.shows_lit_side(seen->pose.origin_in_source())) return std::nullopt;
    px.push_back(seen->px);
  }
  return px;
}

}  // namespace

LampTruth lamp_truth(const Lamp& lamp, const Frame& frame, const Motion& motion,
                     const Camera& camera) {
  LampTruth truth;
  truth.id = lamp.id;
  const auto centre = motion.seen(lamp.centre_m, camera);
  if (centre) truth.centre_px = centre->px;
  const auto rim = projected_rim(lamp, motion, camera);
  if (!rim || !centre) return truth;
  if (const auto px = project_lamp_centre(lamp, centre->pose, camera)) truth.image_centre_px = *px;
  const auto inside = std::count_if(rim->begin(), rim->end(),
                                    [&](const Eigen::Vector2d& px) { return camera.contains(px); });
  truth.whole = inside == static_cast<std::ptrdiff_t>(rim->size());
  truth.in_view = is_in_view(*rim, camera);
  if (truth.in_view) truth.rim_px = *rim;
  if (frame.plan.applies(Effect::occlusion))
    truth.hidden = 1 - visible_part(lamp, frame.scene.boxes, centre->pose.origin_in_source()).share;
  truth.in_view = truth.in_view && truth.hidden < 1;
  return truth;
}

}  // namespace occ::internal::simulate
