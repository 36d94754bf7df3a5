// SPDX-License-Identifier: Apache-2.0
// Vignetting: the lens transmits less light to the edge of the image, V < 1. Without the effect, V
// = 1: a pixel changes by the largest 1 - V over the lamp's image and its blur. The centroid of the
// image moves by its second moment times grad ln V, with R^2/3 for the second moment as in
// light_gradient.cpp.
#include "libocc/scene/internal/vignetting.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {

using namespace internal::scene;
namespace vignetting_effect {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  const std::vector<double>& a = scene.lens.vignetting;
  return std::any_of(a.begin(), a.end(), [](double coefficient) { return coefficient != 0; });
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  constexpr int around = 16;
  constexpr double blur_sigmas = 3;
  const Vignetting vignetting(view.scene);
  const double radius = seen.radius_px + blur_sigmas * blur_width_px(seen, view) + 0.5;
  const double centre = vignetting.transmission(seen.image_centre_px);
  double loss = 1 - centre, max_slope = 0;
  for (int i = 0; i < around; ++i)
    for (const double fraction : {0.5, 1.0}) {
      const double angle = 2 * pi * i / around;
      const Eigen::Vector2d px =
          seen.image_centre_px +
          fraction * radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const double here = vignetting.transmission(px);
      loss = std::max(loss, 1 - here);
      max_slope = std::max(max_slope, std::abs(std::log(here / centre)) / (fraction * radius));
    }
  const double width = blur_width_px(seen, view);
  const double second_moment = seen.radius_px * seen.radius_px / 3 + width * width + 1.0 / 12;
  return {loss * seen.peak_e, second_moment * max_slope};
}

Bound bound(const SceneView& view) {
  Bound bound = sum_of_overlapping(view, bound_of);
  bound.dn += view.grey_levels(max_wall_electrons(view));
  return bound;
}

}  // namespace
}  // namespace vignetting_effect

double seen_transmission(const SceneView& view, const Eigen::Vector2d& px) {
  if (view.scene.effects.of(Effect::vignetting) == Use::off) return 1;
  return Vignetting(view.scene).transmission(px);
}

const EffectModel vignetting_model{
    Effect::vignetting, Stage::lamp_image, vignetting_effect::called_for,
    "all coefficients of lens.vignetting are 0", vignetting_effect::bound};

}  // namespace occ::internal::simulate
