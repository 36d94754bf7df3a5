// SPDX-License-Identifier: Apache-2.0
// The lens's distortion. Left out, a lamp is where a pinhole sees it: its centroid moves by no more
// than the farthest-moved point of its rim, a pixel changes what such a move of the image does
// (internal/blur.hpp), by what the lens concentrates or spreads of the light there, and by all that
// the room's surfaces send.
#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/blur.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/overlap.hpp"

namespace occ::internal::simulate {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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
  // A lamp that the lens does not see may be in a pinhole's image.
  const Camera pinhole = view.scene.camera.without_distortion();
  for (const Lamp* lamp : unseen_lamps(view))
    if (is_seen_from(*lamp, view.cam_from_world, pinhole, view, false)) return {infinity, infinity};
  Bound bound = sum_of_overlapping(view, bound_of);
  bound.dn += view.grey_levels(lit_wall_electrons(view));
  return bound;
}

}  // namespace

const EffectModel distortion_model{"camera.distortion", called_for, bound};

}  // namespace occ::internal::simulate
