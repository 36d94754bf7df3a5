// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/rim_light.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"

namespace occ::internal::refine {

RimLight::RimLight(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                   const Scene& scene)
    : blob_(blob) {
  if (blob.rim_light_response_px > 0 && lamp.shape != LampShape::point)
    brightness_ = brightness(lamp, cam_from_world, scene);
  if (!brightness_) shift_px_ = light_shift_px(lamp, blob, cam_from_world, scene);
}

std::optional<RimLight::Brightness> RimLight::brightness(const Lamp& lamp,
                                                         const Rigid3& cam_from_world,
                                                         const Scene& scene) const {
  const LampIrradiance light(lamp, cam_from_world, scene.camera, scene.sensor);
  const double step_px = std::max(0.5, blob_.ellipse.semi_major_px);
  bool seen = true;
  const auto at = [&](int x, int y) {
    const double irradiance = light.at(blob_.centroid_px + step_px * Eigen::Vector2d(x, y));
    seen = seen && irradiance > 0;
    return std::log(irradiance);
  };
  const double centre = at(0, 0), right = at(1, 0), left = at(-1, 0), below = at(0, 1),
               above = at(0, -1), ahead = at(1, 1), behind = at(-1, -1);
  if (!seen) return std::nullopt;
  Brightness out;
  out.gradient = Eigen::Vector2d(right - left, below - above) / (2 * step_px);
  const double xx = right + left - 2 * centre, yy = below + above - 2 * centre;
  const double xy = 0.5 * (ahead + behind - 2 * centre - xx - yy);
  out.bend << xx, xy, xy, yy;
  out.bend /= step_px * step_px;
  return out;
}

Eigen::Vector2d RimLight::displacement_px(const Eigen::Vector2d& px,
                                          const Eigen::Vector2d& normal) const {
  if (!brightness_) return shift_px_;
  const Eigen::Vector2d at = px - blob_.rim_light_depth_px * normal - blob_.centroid_px;
  const double brighter = brightness_->gradient.dot(at) + 0.5 * at.dot(brightness_->bend * at);
  // Under a Gaussian blur of sigma s, with the hazard h of the normal distribution, the response is
  // s / h, the depth s h, and the response falls by the share 1 / (h + 0.17)^2 per ln of the
  // brightness (the approximation of Tail::depth() in detect).
  constexpr double min_part = 0.5;
  const double hazard = std::sqrt(blob_.rim_light_depth_px / blob_.rim_light_response_px);
  const double part = std::max(min_part, 1 - 0.5 * brighter / square(hazard + 0.17));
  return part * blob_.rim_light_response_px * brighter * normal;
}

}  // namespace occ::internal::refine
