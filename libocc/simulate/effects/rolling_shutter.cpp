// SPDX-License-Identifier: Apache-2.0
// The camera moves between lines: each is exposed row_time_s after the one before. Left out, all
// lines see the poses of the first one's exposure, so that a lamp moves by as much as the camera
// has moved its image when the line that sees it begins, v t_row lines, and its light by as much as
// that changes.
#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/blur.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/motion.hpp"
#include "libocc/simulate/internal/overlap.hpp"
#include "libocc/simulate/internal/vignetting.hpp"

namespace occ::internal::simulate {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
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
  // Lines that see but the blur of a point have moved on from where the point itself is seen.
  return {change_by_shift_e(seen, view, moved + per_line * reach_px) + brighter * seen.peak_e,
          moved + 2 * sampling_shift_px(seen, view)};
}

Bound bound(const SceneView& view) {
  if (any_comes_into_view(view, motion_of(view))) return {infinity, infinity};
  return sum_of_overlapping(view, bound_of);
}

}  // namespace

const EffectModel rolling_shutter_model{"a velocity of the camera and sensor.row_time_s",
                                        called_for, bound};

}  // namespace occ::internal::simulate
