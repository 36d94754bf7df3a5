// SPDX-License-Identifier: Apache-2.0
// Ghosts: second images about the principal point c, a point at p seen at c + s (p - c) too. That
// is what the same camera sees with |s| times the focal length, turned by 180 degrees about its
// axis where s < 0 (the even terms of its distortion change sign). Their light is the lamp's times
// the strength, spread over s^2 of the area; the aperture that goes with the focal length would
// admit s^2 times the light. Left out, a pixel lacks at most strength / s^2 of a fully covered
// one's, for every ghost and all lamps whose ghosts overlap.
#include "libocc/simulate/internal/ghosts.hpp"

#include <cmath>

#include "libocc/simulate/internal/background.hpp"
#include "libocc/simulate/internal/effect_model.hpp"

namespace occ::internal::simulate {
namespace {

// OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty.
std::vector<double> turned(std::vector<double> distortion) {
  for (const std::size_t even : {2u, 3u, 8u, 9u, 10u, 11u, 12u, 13u})
    if (even < distortion.size()) distortion[even] = -distortion[even];
  return distortion;
}

Camera ghost_camera(const Camera& c, double scale) {
  const double s = std::abs(scale);
  return Camera::pinhole(c.width(), c.height(), s * c.fx_px(), s * c.fy_px(), c.cx_px(), c.cy_px(),
                         scale < 0 ? turned(c.distortion()) : c.distortion(), s * c.skew_px());
}

bool called_for(const Scene& scene, const SimulateOptions&) {
  for (const Ghost& ghost : scene.lens.ghosts)
    if (ghost.strength > 0) return true;
  return false;
}

Bound bound(const SceneView& view) { return {view.grey_levels(ghost_electrons(view)), 0}; }

}  // namespace

GhostView ghost_view(const Scene& scene, const Rigid3& cam_from_world,
                     const SimulateOptions& options, const Ghost& ghost) {
  GhostView view{scene, cam_from_world, options};
  view.scene.camera = ghost_camera(scene.camera, ghost.scale);
  view.scene.sensor.psf_sigma_px = std::hypot(scene.sensor.psf_sigma_px, ghost.blur_px);
  for (Lamp& lamp : view.scene.lamps) lamp.power_w *= ghost.strength / (ghost.scale * ghost.scale);
  if (ghost.scale < 0) {
    const Eigen::Vector3d turn(-1, -1, 1);
    view.cam_from_world.rotation = turn.asDiagonal() * cam_from_world.rotation;
    view.cam_from_world.translation = turn.asDiagonal() * cam_from_world.translation;
    view.options.velocity.head<3>() = turn.asDiagonal() * options.velocity.head<3>();
    view.options.velocity.tail<3>() = turn.asDiagonal() * options.velocity.tail<3>();
  }
  return view;
}

const EffectModel ghosts_model{"lens.ghosts", called_for, bound};

}  // namespace occ::internal::simulate
