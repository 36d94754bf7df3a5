// SPDX-License-Identifier: Apache-2.0
// The lens's distortion. Left out, a lamp is where a pinhole sees it: its centroid moves by no more
// than the farthest-moved point of its rim, and a pixel changes by that times the length of rim in
// it (at most its circumference).
#include <algorithm>

#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  const std::vector<double>& d = scene.camera.distortion();
  return std::any_of(d.begin(), d.end(), [](double coefficient) { return coefficient != 0; });
}

Bound bound(const View& view) {
  constexpr double circumference_px = 4;
  constexpr int rim_points = 16;
  const Camera& camera = view.scene.camera;
  const Camera pinhole =
      Camera::pinhole(camera.width(), camera.height(), camera.fx_px(), camera.fy_px(),
                      camera.cx_px(), camera.cy_px(), {}, camera.skew_px());
  Bound bound;
  for (const LampView& seen : view.lamps) {
    const auto with = project_rim(*seen.lamp, view.cam_from_world, camera, rim_points);
    const auto without = project_rim(*seen.lamp, view.cam_from_world, pinhole, rim_points);
    if (!with || !without) continue;
    double moved = 0;
    for (std::size_t i = 0; i < with->size(); ++i)
      moved = std::max(moved, ((*with)[i] - (*without)[i]).norm());
    const double sharp = seen.rim_px.empty() ? seen.electrons : seen.full_e;
    bound.include({view.grey_levels(std::min(1.0, circumference_px * moved) * sharp), moved});
  }
  return bound;
}

}  // namespace

const EffectModel distortion_model{"camera.distortion", called_for, bound};

}  // namespace occ
