// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/docking.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/guide/internal/control_limits.hpp"

namespace occ {

using namespace internal::guide;
namespace {

void require_pose(const PlanarPose& pose, const char* name) {
  require(pose.finite(), name, Eigen::RowVector3d(pose.x_m, pose.y_m, pose.heading_rad), "finite");
}

class Docking {
 public:
  Docking(const PlanarPose& in_dock, double speed_m_s, const Vehicle& vehicle,
          const DockOptions& options)
      : here_(in_dock), speed_m_s_(speed_m_s), vehicle_(vehicle), options_(options) {
    output_.in_dock = in_dock;
  }

  DockOutput run(DockPhase phase) && {
    output_.phase = next(phase);
    switch (output_.phase) {
      case DockPhase::approach:
        approach();
        break;
      case DockPhase::creep:
        creep();
        break;
      case DockPhase::align:
        align();
        break;
      case DockPhase::retreat:
        ask(-0.5 * options_.approach_speed_m_s, 0);
        break;
      case DockPhase::docked:
        break;  // stand still
    }
    return output_;
  }

 private:
  DockPhase next(DockPhase phase) const {
    const double left_m = -here_.x_m;
    if (phase == DockPhase::approach && left_m <= options_.creep_distance_m) {
      const bool on_axis =
          std::abs(here_.y_m) <= options_.max_aside_m && std::abs(here_.heading_rad) <= 0.5;
      phase = on_axis ? DockPhase::creep : DockPhase::retreat;
    }
    if (phase == DockPhase::retreat && left_m > 3 * options_.creep_distance_m)
      phase = DockPhase::approach;
    if (phase == DockPhase::creep && left_m <= options_.tolerance_m + stopping_m())
      phase = vehicle_.drive == Drive::differential ? DockPhase::align : DockPhase::docked;
    if (phase == DockPhase::align && std::abs(here_.heading_rad) <= options_.tolerance_rad)
      phase = DockPhase::docked;
    return phase;
  }

  double stopping_m() const {
    return 0.5 * speed_m_s_ * speed_m_s_ / vehicle_.max_acceleration_m_s2;
  }

  void approach() {
    // Aims at a point between the dock and the begin of creeping, because the law has a pole at its
    // target.
    const double x = here_.x_m + 0.5 * options_.creep_distance_m;
    const double r = std::hypot(x, here_.y_m);
    const double sight = std::atan2(-here_.y_m, -x);
    const double theta = wrapped_rad(-sight), delta = wrapped_rad(here_.heading_rad - sight);
    const double k1 = options_.k1;
    const double curvature = -(options_.k2 * (delta - std::atan(-k1 * theta)) +
                               (1 + k1 / (1 + std::pow(k1 * theta, 2))) * std::sin(delta)) /
                             std::max(r, 0.25 * options_.creep_distance_m);
    const double braking_m = std::max(-here_.x_m - options_.creep_distance_m, 0.0);
    const double in_time = std::sqrt(std::pow(options_.creep_speed_m_s, 2) +
                                     vehicle_.max_acceleration_m_s2 * braking_m);
    const double smooth = options_.approach_speed_m_s /
                          (1 + options_.beta * std::pow(std::abs(curvature), options_.lambda));
    ask(std::max(std::min(smooth, in_time), options_.min_speed_m_s), curvature);
  }

  void creep() {
    const double length = options_.track_length_m;
    const double curvature = -2 * here_.heading_rad / length - here_.y_m / (length * length);
    const double speed = std::max(options_.slowing_1_s * -here_.x_m, options_.min_speed_m_s);
    // Limits the correction to a quarter turn within the track length.
    ask(std::min(speed, options_.creep_speed_m_s),
        std::clamp(curvature, -1.57 / length, 1.57 / length));
  }

  void align() {
    // Slows down in proportion to the remaining angle; a step of 10 ms then stays below the
    // tolerance.
    const double rate = std::clamp(2 * std::abs(here_.heading_rad), 0.02 * options_.tolerance_rad,
                                   vehicle_.max_turn_rate_rad_s);
    output_.command = {0, -std::copysign(rate, here_.heading_rad), 0};
  }

  void ask(double speed_m_s, double curvature) {
    output_.speed_limited = std::abs(speed_m_s) > vehicle_.max_speed_m_s;
    output_.curve_limited = curve_is_limited(vehicle_, speed_m_s, curvature);
    output_.command = curve_command(
        vehicle_, std::clamp(speed_m_s, -vehicle_.max_speed_m_s, vehicle_.max_speed_m_s),
        curvature);
  }

  PlanarPose here_;
  double speed_m_s_;
  const Vehicle& vehicle_;
  const DockOptions& options_;
  DockOutput output_;
};

}  // namespace

const char* to_string(DockPhase phase) {
  switch (phase) {
    case DockPhase::approach:
      return "approach";
    case DockPhase::creep:
      return "creep";
    case DockPhase::align:
      return "align";
    case DockPhase::retreat:
      return "retreat";
    case DockPhase::docked:
      return "docked";
  }
  return "unknown";
}

void DockOptions::validate() const {
  const auto positive = [](double value, const char* name) {
    require(std::isfinite(value) && value > 0, name, value, "positive");
  };
  positive(k1, "k1");
  positive(k2, "k2");
  require(std::isfinite(beta) && beta >= 0, "beta", beta, "finite and >= 0");
  require(std::isfinite(lambda) && lambda >= 1, "lambda", lambda, "finite and >= 1");
  positive(approach_speed_m_s, "approach_speed_m_s");
  positive(creep_distance_m, "creep_distance_m");
  positive(creep_speed_m_s, "creep_speed_m_s");
  positive(slowing_1_s, "slowing_1_s");
  positive(min_speed_m_s, "min_speed_m_s");
  positive(track_length_m, "track_length_m");
  positive(max_aside_m, "max_aside_m");
  positive(tolerance_m, "tolerance_m");
  positive(tolerance_rad, "tolerance_rad");
}

DockOutput dock(const PlanarPose& pose, double speed_m_s, const PlanarPose& target,
                const Vehicle& vehicle, DockPhase phase, const DockOptions& options) {
  vehicle.validate();
  options.validate();
  require_pose(pose, "pose");
  require_pose(target, "target");
  require(std::isfinite(speed_m_s), "speed_m_s", speed_m_s, "finite");
  return Docking(target.inverse() * pose, speed_m_s, vehicle, options).run(phase);
}

}  // namespace occ
