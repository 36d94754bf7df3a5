// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/motion.hpp"

#include <algorithm>
#include <cmath>

namespace occ::internal::simulate {

Motion::Motion(const Scene& scene, const Rigid3& cam_from_world, const SimulateOptions& options,
               const Effects& effects)
    : scene_(scene),
      cam_from_world_(cam_from_world),
      options_(options),
      effects_(effects),
      exposure_s_(scene.sensor.exposure_s),
      line_time_s_(scene.sensor.row_time_s),
      moves_(!options.velocity.isZero(0)),
      still_pose_(moved_pose(cam_from_world, options.velocity, still_s())) {}

Motion::Motion(const Frame& frame)
    : Motion(frame.scene, frame.cam_from_world, frame.options,
             {frame.plan.applies(Effect::motion_blur), frame.plan.applies(Effect::rolling_shutter),
              frame.plan.applies(Effect::modulation)}) {}

Motion::Kind Motion::kind(const Lamp& lamp) const {
  const bool blinks_by_lines = lamp.frequency_hz && line_time_s_ > 0 && effects_.modulation;
  if (effects_.rolling_shutter || (effects_.blur && blinks_by_lines)) return Kind::by_lines;
  return effects_.blur ? Kind::blurred : Kind::still;
}

Rigid3 Motion::pose_at(double time_s) const {
  if (time_s == still_s()) return still_pose_;
  return moved_pose(cam_from_world_, options_.velocity, time_s);
}

int Motion::lines() const { return by_columns() ? scene_.camera.width() : scene_.camera.height(); }

std::vector<LightNode> Motion::nodes(const Lamp& lamp, int line, int panels) const {
  const double begin = line_begin_s(line);
  const double light_begin = options_.start_s + line * line_time_s_;
  if (!effects_.blur)
    return {{begin + 0.5 * exposure_s_,
             light_moments(lamp, effects_.modulation, light_begin, exposure_s_).mean}};
  std::vector<LightNode> nodes;
  const double length = exposure_s_ / panels;
  for (int i = 0; i < panels; ++i) {
    const LightMoments light =
        light_moments(lamp, effects_.modulation, light_begin + i * length, length);
    if (!(light.mean > 0)) continue;
    const double middle = begin + i * length + light.mean_time_s;
    const double weight = 0.5 * light.mean / panels;
    nodes.push_back({middle - light.sigma_s, weight});
    nodes.push_back({middle + light.sigma_s, weight});
  }
  return nodes;
}

std::optional<Motion::Seen> Motion::seen(const Eigen::Vector3d& point_in_world,
                                         const Camera& camera) const {
  constexpr int max_steps =
      30;  // each multiplies the error by the lines that a point moves per line
  double time_s = still_s();
  Seen seen;
  for (int step = 0; step < max_steps; ++step) {
    seen.pose = pose_at(time_s);
    const auto px = camera.project(seen.pose * point_in_world);
    if (!px) return std::nullopt;
    seen.px = *px;
    const double line = std::clamp(by_columns() ? px->x() : px->y(), 0.0, lines() - 1.0);
    const double then = line_begin_s(line) + still_s();
    if (std::abs(then - time_s) <= 1e-9 * (exposure_s_ + line_time_s_)) break;
    time_s = then;
  }
  return seen;
}

}  // namespace occ::internal::simulate
