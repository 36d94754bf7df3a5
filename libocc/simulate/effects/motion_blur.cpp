// SPDX-License-Identifier: Apache-2.0
// Motion blur: the camera moves during the exposure, so a lamp's image is the mean of its images
// from all poses of the exposure. Without the effect, it is the image from the pose in the middle
// of the exposure. A straight path of length b, passed at constant speed, spreads the image by a
// variance of b^2/12. Because f(s) + f(-s) - 2 f(0) is at most s^2 max |f''|, a pixel changes by at
// most b^2/24 max |f''|. For a straight edge of height E this is
//     b^2/24  E / (sqrt(2 pi e) sigma^2) = 0.0101 b^2 E / sigma^2;
// internal/scene_view.hpp has thin lamps and points. The mean of the image also moves if the path
// is curved or if the lamp blinks. If the light grows along the path by a factor 1 + q, the mean
// moves by b q/12.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/line_image.hpp"

namespace occ::internal::simulate {
namespace motion_blur_effect {
namespace {

constexpr int rim_points = 16;

bool called_for(const Scene&, const SimulateOptions& options) {
  return !options.velocity.isZero(0);
}

Motion motion_of(const SceneView& view) {
  const Effects& effects = view.scene.effects;
  const bool rolls =
      view.scene.sensor.row_time_s > 0 && effects.of(Effect::rolling_shutter) != Use::off;
  return Motion(view.scene, view.cam_from_world, view.options,
                {true, rolls, effects.of(Effect::modulation) != Use::off});
}

// Largest distance between the mean time of a blinking lamp's light and the middle of the exposure,
// in exposures. The excess of the light over its mean never adds up to more than 1/4 period.
double max_time_shift(const Lamp& lamp, const SceneView& view) {
  if (!lamp.frequency_hz || view.scene.effects.of(Effect::modulation) == Use::off) return 0;
  const double excess = 0.25 / (*lamp.frequency_hz * view.scene.sensor.exposure_s);
  const double min_light = lamp.mean_light() - excess;
  return min_light > 0 ? std::min(0.5, 1.5 * excess / min_light) : 0.5;
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  const Motion motion = motion_of(view);
  const Camera& camera = view.scene.camera;
  const auto middle = motion.seen(seen.lamp->centre_m, camera);
  if (!middle) return {infinity, infinity};
  const double exposure = motion.exposure_s();
  // The pose in the middle of the exposure, and those at its ends.
  const auto rim_after = [&](double time_s) {
    return project_rim(*seen.lamp, moved_pose(middle->pose, view.options.velocity, time_s), camera,
                       rim_points);
  };
  const auto before = rim_after(-0.5 * exposure), at = rim_after(0),
             after = rim_after(0.5 * exposure);
  if (!before || !at || !after) return {infinity, infinity};
  double length = 0, curved = 0;
  for (std::size_t i = 0; i < at->size(); ++i) {
    const Eigen::Vector2d &a = (*before)[i], &b = (*at)[i], &c = (*after)[i];
    length = std::max(length, (b - a).norm() + (c - b).norm());
    curved = std::max(curved, (a + c - 2 * b).norm() / 6);
  }
  const auto light = [&](double time_s) {
    const Rigid3 pose = moved_pose(middle->pose, view.options.velocity, time_s);
    const auto px = camera.project(pose * seen.lamp->centre_m);
    return px ? lamp_electrons(*seen.lamp, pose, camera, view.scene.sensor) *
                    seen_transmission(view, *px)
              : 0;
  };
  const double brighter = std::abs(std::log(light(0.5 * exposure) / light(-0.5 * exposure)));
  const double moved = curved + max_time_shift(*seen.lamp, view) * length + length / 12 * brighter;
  return {change_by_spread_e(seen, view, length) + change_by_shift_e(seen, view, moved),
          moved + 2 * sampling_shift_px(seen, view)};
}

Bound bound(const SceneView& view) {
  if (any_comes_into_view(view, motion_of(view))) return {infinity, infinity};
  return sum_of_overlapping(view, bound_of);
}

}  // namespace
}  // namespace motion_blur_effect

const EffectModel motion_blur_model{Effect::motion_blur, Stage::lamp_image,
                                    motion_blur_effect::called_for, "the camera has no velocity",
                                    motion_blur_effect::bound};

}  // namespace occ::internal::simulate
