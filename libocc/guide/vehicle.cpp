// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/vehicle.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

/// Changes `now` towards `requested` at a limited rate; returns the final value and the mean over
/// the step.
struct Ramp {
  double end = 0, mean = 0;
  bool limited = false;

  Ramp(double now, double requested, double rate, double dt_s) {
    const double needed_s = std::abs(requested - now) / rate;
    limited = needed_s > dt_s * (1 + 1e-9);
    end = limited ? now + std::copysign(rate * dt_s, requested - now) : requested;
    const double ramp_s = std::min(needed_s, dt_s);
    mean = (0.5 * (now + end) * ramp_s + end * (dt_s - ramp_s)) / dt_s;
  }
};

/// Travel of the two wheels.
struct Wheels {
  double left_m = 0, right_m = 0;

  static Wheels of(double length_m, double turn_rad, double track_m) {
    const double half = 0.5 * track_m * turn_rad;
    return {length_m - half, length_m + half};
  }
  double length_m() const { return 0.5 * (left_m + right_m); }
  double turn_rad(double track_m) const { return (right_m - left_m) / track_m; }
};

/// Standard normal numbers for the errors of one step.
struct Draws {
  double drive[2], slip[2], odometry[2], sideways;

  explicit Draws(Random& random) {
    for (double* pair : {drive, slip, odometry})
      for (int i = 0; i < 2; ++i) pair[i] = random.normal();
    sideways = random.normal();
  }
};

Wheels disturbed(const Wheels& wheels, double noise, const double draws[2]) {
  if (noise == 0) return wheels;
  return {wheels.left_m + noise * std::sqrt(std::abs(wheels.left_m)) * draws[0],
          wheels.right_m + noise * std::sqrt(std::abs(wheels.right_m)) * draws[1]};
}

Wheels on_the_ground(const Wheels& turned, const DriveNoise& noise, const Draws& draws) {
  Wheels ground = disturbed(turned, noise.slip, draws.slip);
  if (noise.slip_share == 0) return ground;
  ground.left_m -= noise.slip_share * turned.left_m;
  ground.right_m -= noise.slip_share * turned.right_m;
  return ground;
}

Wheels as_reported(const Wheels& turned, const DriveNoise& noise, const Draws& draws) {
  Wheels reported = disturbed(turned, noise.odometry, draws.odometry);
  reported.left_m *= noise.left_scale;
  reported.right_m *= noise.right_scale;
  return reported;
}

/// Derivative of arc(length, turn) by [length, turn]; rows x, y, heading.
Eigen::Matrix<double, 3, 2> arc_jacobian(double length_m, double turn_rad) {
  Eigen::Matrix<double, 3, 2> jacobian;
  const PlanarPose unit = arc(1, turn_rad);
  // Derivative by turn: the integrals of -s sin(a s) and s cos(a s) over s in [0, 1].
  double by_x = -turn_rad / 3, by_y = 0.5 - turn_rad * turn_rad / 8;
  if (std::abs(turn_rad) > 1e-3) {
    by_x = (std::cos(turn_rad) - unit.x_m) / turn_rad;
    by_y = (std::sin(turn_rad) - unit.y_m) / turn_rad;
  }
  jacobian << unit.x_m, length_m * by_x, unit.y_m, length_m * by_y, 0, 1;
  return jacobian;
}

/// Covariance of the reported increment about the true one, as modelled by `noise`.
Eigen::Matrix3d odometry_covariance(const Wheels& reported, const Vehicle& vehicle) {
  const DriveNoise& noise = vehicle.noise;
  const auto variance = [&](double travel_m) {
    return (noise.slip * noise.slip + noise.odometry * noise.odometry) * std::abs(travel_m) +
           std::pow(noise.scale_sigma * travel_m, 2);
  };
  const double left = variance(reported.left_m), right = variance(reported.right_m);
  const double track = vehicle.track_m;
  Eigen::Matrix2d motion;  // covariance of [length, turn]
  motion << 0.25 * (left + right), 0.5 * (right - left) / track, 0.5 * (right - left) / track,
      (left + right) / (track * track);
  const Eigen::Matrix<double, 3, 2> jacobian =
      arc_jacobian(reported.length_m(), reported.turn_rad(track));
  Eigen::Matrix3d covariance = jacobian * motion * jacobian.transpose();
  covariance(1, 1) += std::pow(noise.sideways_slip, 2) * std::abs(reported.length_m());
  return 0.5 * (covariance + covariance.transpose());
}

void require_state(const DriveState& state, const DriveCommand& command) {
  require(std::isfinite(state.time_s), "state.time_s", state.time_s, "finite");
  require(state.pose.finite(), "state.pose",
          Eigen::RowVector3d(state.pose.x_m, state.pose.y_m, state.pose.heading_rad), "finite");
  require(std::isfinite(state.speed_m_s), "state.speed_m_s", state.speed_m_s, "finite");
  require(std::isfinite(state.turn_rate_rad_s), "state.turn_rate_rad_s", state.turn_rate_rad_s,
          "finite");
  require(std::isfinite(state.steering_rad), "state.steering_rad", state.steering_rad, "finite");
  require(std::isfinite(command.speed_m_s), "command.speed_m_s", command.speed_m_s, "finite");
  require(std::isfinite(command.turn_rate_rad_s), "command.turn_rate_rad_s",
          command.turn_rate_rad_s, "finite");
  require(std::isfinite(command.steering_rad), "command.steering_rad", command.steering_rad,
          "finite");
}

/// Clips the command and reports what was clipped.
double clipped(double requested, double limit, bool& limited) {
  limited = std::abs(requested) > limit;
  return std::clamp(requested, -limit, limit);
}

/// Computes length and rotation of a step from its ramps; sets the final rates of the state.
Wheels asked_travel(const Vehicle& vehicle, const DriveState& state, const DriveCommand& command,
                    double dt_s, DriveStep& step) {
  const bool steers = vehicle.drive == Drive::ackermann;
  DriveLimited& limited = step.limited;
  const Ramp speed(state.speed_m_s,
                   clipped(command.speed_m_s, vehicle.max_speed_m_s, limited.speed),
                   vehicle.max_acceleration_m_s2, dt_s);
  const Ramp turning =
      steers ? Ramp(state.steering_rad,
                    clipped(command.steering_rad, vehicle.max_steering_rad, limited.turn),
                    vehicle.max_steering_rate_rad_s, dt_s)
             : Ramp(state.turn_rate_rad_s,
                    clipped(command.turn_rate_rad_s, vehicle.max_turn_rate_rad_s, limited.turn),
                    vehicle.max_turn_acceleration_rad_s2, dt_s);
  limited.acceleration = speed.limited;
  limited.turn_change = turning.limited;
  step.state.speed_m_s = speed.end;
  step.state.steering_rad = steers ? turning.end : 0;
  step.state.turn_rate_rad_s =
      steers ? speed.end * std::tan(turning.end) / vehicle.wheelbase_m : turning.end;
  const double length_m = speed.mean * dt_s;
  const double turn_rad =
      steers ? length_m * std::tan(turning.mean) / vehicle.wheelbase_m : turning.mean * dt_s;
  return Wheels::of(length_m, turn_rad, vehicle.track_m);
}

PlanarPose increment_of(const Wheels& wheels, double track_m) {
  return arc(wheels.length_m(), wheels.turn_rad(track_m));
}

}  // namespace

void DriveNoise::validate() const {
  const auto not_negative = [](double value, const char* name) {
    require(std::isfinite(value) && value >= 0, name, value, "finite and >= 0");
  };
  not_negative(drive, "drive");
  not_negative(slip, "slip");
  require(slip_share >= 0 && slip_share < 1, "slip_share", slip_share, "in [0, 1)");
  not_negative(sideways_slip, "sideways_slip");
  not_negative(odometry, "odometry");
  require(std::isfinite(left_scale) && left_scale > 0, "left_scale", left_scale, "positive");
  require(std::isfinite(right_scale) && right_scale > 0, "right_scale", right_scale, "positive");
  not_negative(scale_sigma, "scale_sigma");
}

double Vehicle::min_radius_m() const {
  return drive == Drive::ackermann ? wheelbase_m / std::tan(max_steering_rad) : 0;
}

void Vehicle::validate() const {
  const auto positive = [](double value, const char* name) {
    require(std::isfinite(value) && value > 0, name, value, "positive");
  };
  positive(track_m, "track_m");
  positive(wheelbase_m, "wheelbase_m");
  require(std::isfinite(radius_m) && radius_m >= 0, "radius_m", radius_m, "finite and >= 0");
  positive(max_speed_m_s, "max_speed_m_s");
  positive(max_acceleration_m_s2, "max_acceleration_m_s2");
  positive(max_turn_rate_rad_s, "max_turn_rate_rad_s");
  positive(max_turn_acceleration_rad_s2, "max_turn_acceleration_rad_s2");
  require(max_steering_rad > 0 && max_steering_rad < pi / 2, "max_steering_rad", max_steering_rad,
          "in (0, pi/2)");
  positive(max_steering_rate_rad_s, "max_steering_rate_rad_s");
  noise.validate();
}

DriveStep drive(const Vehicle& vehicle, const DriveState& state, const DriveCommand& command,
                double dt_s, Random& random) {
  vehicle.validate();
  require_state(state, command);
  require(std::isfinite(dt_s) && dt_s > 0, "dt_s", dt_s, "positive");
  const Draws draws(random);
  DriveStep step;
  const Wheels requested = asked_travel(vehicle, state, command, dt_s, step);
  const Wheels turned = disturbed(requested, vehicle.noise.drive, draws.drive);
  const Wheels ground = on_the_ground(turned, vehicle.noise, draws);
  const Wheels reported = as_reported(turned, vehicle.noise, draws);

  PlanarPose moved = increment_of(ground, vehicle.track_m);
  moved.y_m +=
      vehicle.noise.sideways_slip * std::sqrt(std::abs(ground.length_m())) * draws.sideways;
  step.state.time_s = state.time_s + dt_s;
  step.state.pose = state.pose * moved;
  step.odometry = {state.time_s, step.state.time_s, increment_of(reported, vehicle.track_m),
                   odometry_covariance(reported, vehicle)};
  return step;
}

DriveCommand curve_command(const Vehicle& vehicle, double speed_m_s, double curvature_1_m) {
  if (vehicle.drive == Drive::ackermann) {
    const double steering = std::clamp(std::atan(vehicle.wheelbase_m * curvature_1_m),
                                       -vehicle.max_steering_rad, vehicle.max_steering_rad);
    return {speed_m_s, 0, steering};
  }
  const double turn_rate = speed_m_s * curvature_1_m;
  const double limit = vehicle.max_turn_rate_rad_s;
  if (std::abs(turn_rate) <= limit) return {speed_m_s, turn_rate, 0};
  // Keeps the curvature and reduces the speed, so that the vehicle stays on the curve.
  return {std::copysign(limit / std::abs(curvature_1_m), speed_m_s),
          std::copysign(limit, turn_rate), 0};
}

}  // namespace occ
