// SPDX-License-Identifier: Apache-2.0
// A vehicle on a floor: what it does when a speed and a turn are asked of it, and what its wheels
// say of that. Both kinds roll on two wheels, `track_m` apart, about whose middle, the body's
// origin, they turn without slip; a step is the arc of its mean speed and turn,
//
//   differential drive   turn = turn rate dt
//   Ackermann            turn = speed dt tan(steering) / wheelbase     (bicycle model, rear axle)
//
// While a limit of acceleration holds, speed and turn rate (or steering angle) are ramps, whose
// means over the step are exact. Noise is by wheel and by length: after a length d a wheel's error
// has the variance k^2 |d|, however that length was cut into steps.
//   Siegwart, Nourbakhsh, Scaramuzza, Introduction to Autonomous Mobile Robots, 2nd ed. 2011, sec.
//   5.2.4 (error model of odometry: variance in proportion to each wheel's travel, eq. (5.9)).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/planar_pose.hpp"

namespace occ {

enum class Drive {
  differential,  ///< two driven wheels; turns on the spot
  ackermann,     ///< steers by its front wheels
};

struct DriveCommand {
  double speed_m_s = 0;        ///< of the origin; negative: backwards
  double turn_rate_rad_s = 0;  ///< differential drive; otherwise not looked at
  double steering_rad = 0;     ///< Ackermann: of the bicycle's front wheel, left positive
};

struct DriveState {
  double time_s = 0;
  PlanarPose pose;
  double speed_m_s = 0;
  double turn_rate_rad_s = 0;  ///< as of the pose's heading
  double steering_rad = 0;     ///< Ackermann
};

/// What was asked for and is not to be had.
struct DriveLimited {
  bool speed = false;         ///< beyond max_speed_m_s
  bool turn = false;          ///< beyond max_turn_rate_rad_s or max_steering_rad
  bool acceleration = false;  ///< not at the step's end: max_acceleration_m_s2
  bool turn_change = false;   ///< not at the step's end: the turn rate's or the steering's own rate

  bool any() const { return speed || turn || acceleration || turn_change; }
};

/// Defaults: a perfect vehicle that knows its wheels perfectly.
struct LIBOCC_API DriveNoise {
  double drive = 0;          ///< wheels turn otherwise than asked; they report it [sqrt(m)]
  double slip = 0;           ///< wheels turn without the vehicle following; not reported
  double slip_share = 0;     ///< share of each wheel's travel that is lost, always
  double sideways_slip = 0;  ///< of the origin, across the heading [sqrt(m)]
  double odometry = 0;       ///< of what a wheel reports [sqrt(m)]
  double left_scale = 1;     ///< what the left wheel reports over what it has turned
  double right_scale = 1;
  double scale_sigma = 0;  ///< of both scales, known to the covariance: over a step, all of it

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct LIBOCC_API Vehicle {
  Drive drive = Drive::differential;
  double track_m = 0.4;                ///< between the two wheels that roll without steering
  double wheelbase_m = 0.5;            ///< Ackermann: from the origin to the front axle
  double radius_m = 0.3;               ///< of a disc about the origin that holds all of it
  double max_speed_m_s = 1;            ///< backwards alike
  double max_acceleration_m_s2 = 0.5;  ///< braking alike
  double max_turn_rate_rad_s = 1.5;    ///< differential drive
  double max_turn_acceleration_rad_s2 = 5;
  double max_steering_rad = 0.6;  ///< Ackermann; below pi/2
  double max_steering_rate_rad_s = 1.5;
  DriveNoise noise;

  /// Of the sharpest curve that it can drive; 0 for a differential drive.
  double min_radius_m() const;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct DriveStep {
  DriveState state;         ///< the truth
  PlanarOdometry odometry;  ///< what the wheels say
  DriveLimited limited;
};

/// Moves on by dt_s. Draws the same count of numbers from `random` whatever the noise. Throws
/// std::invalid_argument when the vehicle does not validate, dt_s is not positive, or the command
/// or the state is not finite.
LIBOCC_API DriveStep drive(const Vehicle& vehicle, const DriveState& state,
                           const DriveCommand& command, double dt_s, Random& random);

/// The command that follows a curvature [1/m, left positive] at this speed, within what the vehicle
/// can do: of a curve too sharp the sharpest possible, of a turn too fast the speed that it allows.
LIBOCC_API DriveCommand curve_command(const Vehicle& vehicle, double speed_m_s,
                                      double curvature_1_m);

}  // namespace occ
