// SPDX-License-Identifier: Apache-2.0
// Rolling shutter: the camera moves between lines, because each line is exposed row_time_s after
// the one before. Without the effect all lines record the poses of the first line's exposure. A
// lamp's image moves by the motion of the image until the exposure of the line that records it, and
// its light changes by the change until then.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace rolling_shutter_effect {
namespace {

constexpr int rim_points = 16;

bool called_for(const Scene& scene, const SimulateOptions& options) {
  return !options.velocity.isZero(0) && scene.sensor.row_time_s > 0;
}

Motion motion_of(const SceneView& view) {
  return Motion(view.scene, view.cam_from_world, view.options, {true, true, true});
}

double light_at(const LampView& seen, const SceneView& view, const Rigid3& pose,
                const Eigen::Vector2d& px) {
  const Camera& camera = view.scene.camera;
  const Sensor& sensor = view.scene.sensor;
  const double light = is_point(seen, view) ? lamp_electrons(*seen.lamp, pose, camera, sensor)
                                            : irradiance_at(*seen.lamp, pose, camera, sensor, px);
  return light * seen_transmission(view, px);
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  const Motion motion = motion_of(view);
  const Camera& camera = view.scene.camera;
  const Rigid3 first = motion.still_pose();
  std::vector<Eigen::Vector3d> points = rim_in_world(*seen.lamp, rim_points);
  points.push_back(seen.lamp->centre_m);
  const double reach_px = 5 * blur_sigma_px(view) + blur_radius_px(seen, view) + 1;
  double moved = 0, per_line = 0, brighter = 0;
  for (const Eigen::Vector3d& point : points) {
    const auto then = motion.seen(point, camera);
    const auto before = camera.project(first * point);
    if (!then || !before) return {infinity, infinity};
    moved = std::max(moved, (then->px - *before).norm());
    const Rigid3 next = moved_pose(then->pose, view.options.velocity, view.scene.sensor.row_time_s);
    if (const auto px = camera.project(next * point))
      per_line = std::max(per_line, (*px - then->px).norm());
    const double was = light_at(seen, view, first, *before);
    const double is = light_at(seen, view, then->pose, then->px);
    brighter = std::max(brighter, std::abs(is / was - 1));
  }
  // Lines that see only the blur of a point see it from other poses than the point's own line.
  return {change_by_shift_e(seen, view, moved + per_line * reach_px) + brighter * seen.peak_e,
          moved + 2 * sampling_shift_px(seen, view)};
}

Bound bound(const SceneView& view) {
  if (any_comes_into_view(view, motion_of(view))) return {infinity, infinity};
  return sum_of_overlapping(view, bound_of);
}

}  // namespace
}  // namespace rolling_shutter_effect

const EffectModel rolling_shutter_model{
    Effect::rolling_shutter, Stage::lamp_image, rolling_shutter_effect::called_for,
    "the camera has no velocity, or sensor.row_time_s is 0", rolling_shutter_effect::bound};

}  // namespace occ::internal::simulate
