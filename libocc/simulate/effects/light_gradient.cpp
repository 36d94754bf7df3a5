// SPDX-License-Identifier: Apache-2.0
// Light gradient: the irradiance E of a lamp varies over its image, by cos^4 and by Lambert's law.
// Without the effect, the whole image has the irradiance of the centre. No pixel changes by more
// than E varies over the image. The centroid of an ellipse moves by its second moment times grad ln
// E, at most (R^2/4) |grad ln E|.
#include <algorithm>
#include <cmath>

#include "libocc/formation/light.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {
namespace light_gradient_effect {
namespace {

constexpr double beyond_first_order = 1.2;  // margin for the curvature of E

bool called_for(const Scene& scene, const SimulateOptions&) {
  return std::any_of(scene.lamps.begin(), scene.lamps.end(),
                     [](const Lamp& lamp) { return lamp.shape != LampShape::point; });
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  if (is_point(seen, view)) return {};
  const Camera& camera = view.scene.camera;
  const Sensor& sensor = view.scene.sensor;
  const auto irradiance = [&](const Eigen::Vector2d& px) {
    return irradiance_at(*seen.lamp, view.cam_from_world, camera, sensor, px);
  };
  const double centre = irradiance(seen.centre_px);
  if (!(centre > 0)) return {std::numeric_limits<double>::infinity(), 0};
  double change = 0, steepest = 0;
  for (const Eigen::Vector2d& px : seen.rim_px) {
    const double here = irradiance(px);
    change = std::max(change, std::abs(here - centre));
    const double distance = (px - seen.centre_px).norm();
    if (here > 0 && distance > 0)
      steepest = std::max(steepest, std::abs(std::log(here / centre)) / distance);
  }
  const double relative = beyond_first_order * change / centre;
  // R^2/3 instead of R^2/4 also covers a square, whose image reaches R only at its corners.
  const double second_moment = seen.radius_px * seen.radius_px / 3;
  return {relative * seen.peak_e, beyond_first_order * second_moment * steepest};
}

Bound bound(const SceneView& view) { return sum_of_overlapping(view, bound_of); }

}  // namespace
}  // namespace light_gradient_effect

const EffectModel light_gradient_model{Effect::light_gradient, Stage::lamp_image,
                                       light_gradient_effect::called_for, "all lamps are points",
                                       light_gradient_effect::bound};

}  // namespace occ::internal::simulate
