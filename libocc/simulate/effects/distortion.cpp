// SPDX-License-Identifier: Apache-2.0
// Lens distortion. Without the effect a lamp appears where a pinhole camera images it. Its centroid
// moves by at most the largest displacement of a point of its rim. A pixel changes by that
// displacement of the image (internal/scene_view.hpp), by the light that the lens concentrates or
// spreads there, and by all light of the room's surfaces.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace distortion_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  const std::vector<double>& d = scene.camera.distortion();
  return std::any_of(d.begin(), d.end(), [](double coefficient) { return coefficient != 0; });
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  constexpr int rim_points = 16;
  const Lamp& lamp = *seen.lamp;
  const Camera &lens = view.scene.camera, pinhole = lens.without_distortion();
  std::vector<Eigen::Vector3d> points = rim_in_world(lamp, rim_points);
  points.push_back(lamp.centre_m);
  double moved = 0, brighter = 0;
  for (const Eigen::Vector3d& point : points) {
    const auto with = lens.project(view.cam_from_world * point);
    const auto without = pinhole.project(view.cam_from_world * point);
    if (!with || !without) return {infinity, infinity};
    moved = std::max(moved, (*with - *without).norm());
    if (is_point(seen, view)) continue;
    const auto light = [&](const Camera& camera, const Eigen::Vector2d& px) {
      return irradiance_at(lamp, view.cam_from_world, camera, view.scene.sensor, px);
    };
    brighter = std::max(brighter, std::abs(light(pinhole, *without) / light(lens, *with) - 1));
  }
  return {change_by_shift_e(seen, view, moved) + brighter * seen.full_e,
          moved + 2 * sampling_shift_px(seen, view)};
}

Bound bound(const SceneView& view) {
  // A lamp outside the lens's view may be in the image of a pinhole camera.
  const Camera pinhole = view.scene.camera.without_distortion();
  for (const Lamp* lamp : unseen_lamps(view))
    if (is_seen_from(*lamp, view.cam_from_world, pinhole, view, false)) return {infinity, infinity};
  Bound bound = sum_of_overlapping(view, bound_of);
  bound.dn += view.grey_levels(max_wall_electrons(view));
  return bound;
}

}  // namespace
}  // namespace distortion_effect

const EffectModel distortion_model{
    Effect::distortion, Stage::lamp_image, distortion_effect::called_for,
    "all coefficients of camera.distortion are 0", distortion_effect::bound};

}  // namespace occ::internal::simulate
