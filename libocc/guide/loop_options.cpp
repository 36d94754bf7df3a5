// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/guide/closed_loop.hpp"

namespace occ {
namespace {

/// Validates each element; errors name the element and its field.
template <class Elements, class Check>
void check_each(const Elements& elements, const std::string& name, const Check& check) {
  for (std::size_t i = 0; i < elements.size(); ++i)
    check(elements[i], name + "[" + std::to_string(i) + "]");
}

void require_period(double from_s, double to_s, const std::string& name) {
  require(std::isfinite(from_s), name + ".from_s", from_s, "finite");
  require(to_s > from_s, name + ".to_s", to_s, "after from_s");
}

}  // namespace

void LoopFaults::validate() const {
  require_not_negative(latency_s, "latency_s");
  require(frame_loss >= 0 && frame_loss <= 1, "frame_loss", frame_loss, "in [0, 1]");
  require(frame_repeat >= 0 && frame_repeat <= 1, "frame_repeat", frame_repeat, "in [0, 1]");
  check_each(lamp_failures, "lamp_failures", [](const LampFailure& f, const std::string& name) {
    require_period(f.from_s, f.to_s, name);
  });
  check_each(odometry_faults, "odometry_faults",
             [](const OdometryFault& fault, const std::string& name) {
               require_period(fault.from_s, fault.to_s, name);
               require(std::isfinite(fault.scale), name + ".scale", fault.scale, "finite");
               require(std::isfinite(fault.turn_rate_rad_s), name + ".turn_rate_rad_s",
                       fault.turn_rate_rad_s, "finite");
             });
  check_each(kidnappings, "kidnappings", [](const Kidnapping& k, const std::string& name) {
    require(std::isfinite(k.at_s), name + ".at_s", k.at_s, "finite");
    require(k.to.finite(), name + ".to", Eigen::RowVector3d(k.to.x_m, k.to.y_m, k.to.heading_rad),
            "finite");
  });
  check_each(clock_jumps, "clock_jumps", [](const ClockJump& jump, const std::string& name) {
    require(std::isfinite(jump.at_s), name + ".at_s", jump.at_s, "finite");
    require(std::isfinite(jump.by_s), name + ".by_s", jump.by_s, "finite");
  });
}

void WorldErrors::validate() const {
  require_not_negative(map_sigma_m, "map_sigma_m");
  for (const auto& [name, error] : lens)
    require(std::isfinite(error), "lens." + name, error, "finite");
  require(mount_rotation_rad.allFinite(), "mount_rotation_rad", mount_rotation_rad.transpose(),
          "finite");
  require(mount_shift_m.allFinite(), "mount_shift_m", mount_shift_m.transpose(), "finite");
  require_not_negative(clock_s, "clock_s");
  require_not_negative(floor_tilt_rad, "floor_tilt_rad");
  require_not_negative(floor_height_m, "floor_height_m");
  require_positive(floor_wave_m, "floor_wave_m");
  require_positive(exposure, "exposure");
  require_not_negative(ambient_w_m2, "ambient_w_m2");
  require(ambient_flicker >= 0 && ambient_flicker <= 1, "ambient_flicker", ambient_flicker,
          "in [0, 1]");
  require_positive(flicker_hz, "flicker_hz");
}

void LoopOptions::validate() const {
  vehicle.validate();
  pure_pursuit.validate();
  stanley.validate();
  docking.validate();
  tracker.validate();
  faults.validate();
  world.validate();
  require_positive(vehicle_height_m, "vehicle_height_m");
  require(camera_place_m.allFinite(), "camera_place_m", camera_place_m.transpose(), "finite");
  require(std::isfinite(camera_pan_rad), "camera_pan_rad", camera_pan_rad, "finite");
  require(std::isfinite(camera_tilt_rad), "camera_tilt_rad", camera_tilt_rad, "finite");
  if (pan_tilt) pan_tilt->validate();
  require_positive(pan_tilt_rate_rad_s, "pan_tilt_rate_rad_s");
  require_positive(frame_rate_hz, "frame_rate_hz");
  require_positive(control_rate_hz, "control_rate_hz");
  require(clock_guard_s > 0, "clock_guard_s", clock_guard_s, "positive");
  if (start)
    require(start->finite(), "start",
            Eigen::RowVector3d(start->x_m, start->y_m, start->heading_rad), "finite");
  require_positive(start_sigma_m, "start_sigma_m");
  require_positive(start_sigma_rad, "start_sigma_rad");
  require_positive(max_s, "max_s");
  require_positive(max_lost_s, "max_lost_s");
}

}  // namespace occ
