// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/truth.hpp"

#include <algorithm>

#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

constexpr int rim_points = 64;

// Whether the closed polygon winds around the point.
bool surrounds(const std::vector<Eigen::Vector2d>& rim, const Eigen::Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Eigen::Vector2d a = rim[i] - point, b = rim[(i + 1) % rim.size()] - point;
    if ((a.y() > 0) == (b.y() > 0)) continue;
    if (a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y()) > 0) inside = !inside;
  }
  return inside;
}

}  // namespace

LampTruth lamp_truth(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera) {
  LampTruth truth;
  truth.id = lamp.id;
  if (const auto px = camera.project(cam_from_world * lamp.centre_m)) truth.centre_px = *px;
  const auto rim = project_rim(lamp, cam_from_world, camera, rim_points);
  if (!rim) return truth;
  if (const auto px = project_lamp_centre(lamp, cam_from_world, camera))
    truth.image_centre_px = *px;
  const auto inside = std::count_if(rim->begin(), rim->end(),
                                    [&](const Eigen::Vector2d& px) { return camera.contains(px); });
  truth.whole = inside == static_cast<std::ptrdiff_t>(rim->size());
  const Eigen::Vector2d middle(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  truth.in_view = inside > 0 || surrounds(*rim, middle);
  if (truth.in_view) truth.rim_px = *rim;
  return truth;
}

}  // namespace occ
