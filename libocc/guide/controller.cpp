// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/controller.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/guide/internal/control_limits.hpp"

namespace occ {

using namespace internal::guide;
namespace {

void require_input(const Vehicle& vehicle, const ControlInput& input) {
  vehicle.validate();
  require(input.pose.finite(), "pose",
          Eigen::RowVector3d(input.pose.x_m, input.pose.y_m, input.pose.heading_rad), "finite");
  require(std::isfinite(input.speed_m_s), "speed_m_s", input.speed_m_s, "finite");
  require(std::isfinite(input.turn_rate_rad_s), "turn_rate_rad_s", input.turn_rate_rad_s, "finite");
  if (input.along_m) require(std::isfinite(*input.along_m), "along_m", *input.along_m, "finite");
}

ControlOutput located(const Route& route, const ControlInput& input) {
  ControlOutput output;
  output.place = route.nearest(input.pose.position(), input.along_m);
  output.heading_error_rad = wrapped_rad(output.place.pose.heading_rad - input.pose.heading_rad);
  output.at_end = output.place.along_m >= route.length_m() - 1e-9;
  return output;
}

/// Limits the speed to that of the route and to the braking distance of what lies ahead.
double paced_speed(const Route& route, const Vehicle& vehicle, const PaceOptions& pace,
                   ControlOutput& output) {
  const double along_m = output.place.along_m;
  const double braking = pace.braking * vehicle.max_acceleration_m_s2;
  const auto allowed_before = [&](double speed, double distance_m) {
    return std::sqrt(speed * speed + 2 * braking * std::max(distance_m, 0.0));
  };
  double speed = output.place.speed_m_s;
  output.speed_limited = speed > vehicle.max_speed_m_s;
  const double reach_m = 0.5 * std::pow(std::min(speed, vehicle.max_speed_m_s), 2) / braking;
  for (const RoutePiece& piece : route.pieces()) {
    if (piece.begin_m + piece.length_m < along_m) continue;
    if (piece.begin_m > along_m + reach_m) break;
    const double curve = std::min(1.0, pace.slow_radius_m > 0 && piece.curvature_1_m != 0
                                           ? 1 / std::abs(pace.slow_radius_m * piece.curvature_1_m)
                                           : 1.0);
    const double required = std::max(piece.speed_m_s * curve, pace.min_speed_m_s);
    speed = std::min(speed, allowed_before(required, piece.begin_m - along_m));
  }
  speed = std::min(speed, allowed_before(pace.end_speed_m_s, route.length_m() - along_m));
  return std::clamp(speed, std::min(pace.min_speed_m_s, vehicle.max_speed_m_s),
                    vehicle.max_speed_m_s);
}

/// Turns on the spot at a rate from which the vehicle can stop at the desired heading.
DriveCommand turn_towards(const Vehicle& vehicle, double angle_rad) {
  const double rate =
      std::min(vehicle.max_turn_rate_rad_s,
               0.8 * std::sqrt(2 * vehicle.max_turn_acceleration_rad_s2 * std::abs(angle_rad)));
  return {0, std::copysign(rate, angle_rad), 0};
}

bool turns_first(const Vehicle& vehicle, double angle_rad, double max_rad) {
  return vehicle.drive == Drive::differential && std::abs(angle_rad) > max_rad;
}

/// Half of the time that the vehicle needs to change to the curvature ahead. A preview by this time
/// keeps it on the route.
double half_turn_in_s(const Route& route, const Vehicle& vehicle, const RoutePlace& place,
                      double speed) {
  constexpr double soon_s = 0.5;
  const double ahead = route.at(place.along_m + soon_s * speed).curvature_1_m;
  const double turn_s =
      vehicle.drive == Drive::ackermann
          ? std::abs(std::atan(vehicle.wheelbase_m * ahead) -
                     std::atan(vehicle.wheelbase_m * place.curvature_1_m)) /
                vehicle.max_steering_rate_rad_s
          : speed * std::abs(ahead - place.curvature_1_m) / vehicle.max_turn_acceleration_rad_s2;
  return std::min(0.5 * turn_s, soon_s);
}

void follow_curve(const Vehicle& vehicle, double speed_m_s, double curvature,
                  ControlOutput& output) {
  output.command = curve_command(vehicle, speed_m_s, curvature);
  output.curve_limited = curve_is_limited(vehicle, speed_m_s, curvature);
}

}  // namespace

bool internal::guide::curve_is_limited(const Vehicle& vehicle, double speed_m_s,
                                       double curvature_1_m) {
  if (vehicle.drive == Drive::ackermann)
    return std::abs(curvature_1_m) * vehicle.min_radius_m() > 1;
  return std::abs(speed_m_s * curvature_1_m) > vehicle.max_turn_rate_rad_s;
}

void PaceOptions::validate() const {
  require(braking > 0 && braking <= 1, "braking", braking, "in (0, 1]");
  require_not_negative(slow_radius_m, "slow_radius_m");
  require_positive(min_speed_m_s, "min_speed_m_s");
  require_not_negative(end_speed_m_s, "end_speed_m_s");
}

void PurePursuitOptions::validate() const {
  require_not_negative(lookahead_s, "lookahead_s");
  require_positive(min_lookahead_m, "min_lookahead_m");
  require(max_lookahead_m >= min_lookahead_m && std::isfinite(max_lookahead_m), "max_lookahead_m",
          max_lookahead_m, "finite and >= min_lookahead_m");
  require(turn_on_spot_rad > 0, "turn_on_spot_rad", turn_on_spot_rad, "positive");
  pace.validate();
}

void StanleyOptions::validate() const {
  require_positive(gain_1_s, "gain_1_s");
  require_positive(soft_m_s, "soft_m_s");
  require_not_negative(yaw_damping_s, "yaw_damping_s");
  if (preview_s) require_not_negative(*preview_s, "preview_s");
  require_not_negative(guide_point_m, "guide_point_m");
  require_positive(virtual_wheelbase_m, "virtual_wheelbase_m");
  require(turn_on_spot_rad > 0, "turn_on_spot_rad", turn_on_spot_rad, "positive");
  pace.validate();
}

ControlOutput pure_pursuit(const Route& route, const Vehicle& vehicle, const ControlInput& input,
                           const PurePursuitOptions& options) {
  options.validate();
  require_input(vehicle, input);
  ControlOutput output = located(route, input);
  const double lookahead_m = std::clamp(std::abs(input.speed_m_s) * options.lookahead_s,
                                        options.min_lookahead_m, options.max_lookahead_m);
  const Eigen::Vector2d position = input.pose.position();
  // The look-ahead grows with the deviation and the heading error: on a short arc the vehicle would
  // turn too late and oscillate.
  const double reach_m = lookahead_m * (1 + 4 * std::abs(output.heading_error_rad)) +
                         2 * std::abs(output.place.deviation_m);
  PlanarPose target = route.ahead(position, output.place.along_m, reach_m).pose;
  // Beyond its end the route continues straight.
  const double missing_m = reach_m - (target.position() - position).norm();
  if (missing_m > 1e-9) target = target * PlanarPose{missing_m, 0, 0};
  const Eigen::Vector2d seen = input.pose.inverse() * target.position();
  const double aside_rad = std::atan2(seen.y(), seen.x());
  if (turns_first(vehicle, aside_rad, options.turn_on_spot_rad)) {
    output.command = turn_towards(vehicle, aside_rad);
    return output;
  }
  follow_curve(vehicle, paced_speed(route, vehicle, options.pace, output),
               2 * seen.y() / seen.squaredNorm(), output);
  return output;
}

ControlOutput stanley(const Route& route, const Vehicle& vehicle, const ControlInput& input,
                      const StanleyOptions& options) {
  options.validate();
  require_input(vehicle, input);
  ControlOutput output = located(route, input);
  const double wheelbase_m =
      vehicle.drive == Drive::ackermann ? vehicle.wheelbase_m : options.virtual_wheelbase_m;
  const PlanarPose guide = input.pose * PlanarPose{options.guide_point_m, 0, 0};
  const RoutePlace place = route.nearest(guide.position(), output.place.along_m);
  const double speed = paced_speed(route, vehicle, options.pace, output);
  const double off_rad = wrapped_rad(place.pose.heading_rad - input.pose.heading_rad);
  if (turns_first(vehicle, off_rad, options.turn_on_spot_rad)) {
    output.command = turn_towards(vehicle, off_rad);
    return output;
  }
  const double preview_s = options.preview_s.value_or(half_turn_in_s(route, vehicle, place, speed));
  const double curvature_ahead = route.at(place.along_m + preview_s * speed).curvature_1_m;
  const double turn_rate_error = speed * place.curvature_1_m - input.turn_rate_rad_s;
  const double steering =
      off_rad - std::atan(options.gain_1_s * place.deviation_m / (options.soft_m_s + speed)) +
      options.yaw_damping_s * turn_rate_error +
      std::atan((wheelbase_m - options.guide_point_m) * curvature_ahead);
  constexpr double steepest_rad = 1.4;
  const double curvature =
      std::tan(std::clamp(steering, -steepest_rad, steepest_rad)) / wheelbase_m;
  follow_curve(vehicle, speed, curvature, output);
  return output;
}

}  // namespace occ
