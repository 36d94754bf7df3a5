// SPDX-License-Identifier: Apache-2.0
// Motion model of a wheeled vehicle on a floor, with its odometry.
//
// Two unsteered wheels, `track_m` apart, roll without slip; the origin of the body is midway
// between them. One time step is an arc of the mean speed and mean rotation,
//
//   differential drive   rotation = turn rate dt
//   Ackermann            rotation = speed dt tan(steering) / wheelbase     (bicycle model, rear
//   axle)
//
// While an acceleration limit is active, speed and turn rate (or steering angle) are ramps, whose
// means over the step are exact. Each wheel has an independent error with the variance k^2 |d|
// after the distance d, independent of the step size.
//   Siegwart, Nourbakhsh, Scaramuzza, Introduction to Autonomous Mobile Robots, 2nd ed. 2011, sec.
//   5.2.4 (error model of odometry: variance in proportion to each wheel's travel, eq. (5.9)).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/planar_pose.hpp"

namespace occ {

/// Kinematics of the vehicle.
enum class Drive {
  differential,  ///< two driven wheels; can turn on the spot
  ackermann,     ///< steered front wheels
};

/// Command for one time step.
struct DriveCommand {
  double speed_m_s = 0;        ///< speed of the origin; negative: backwards
  double turn_rate_rad_s = 0;  ///< differential drive; ignored for Ackermann
  double steering_rad = 0;     ///< Ackermann: angle of the bicycle's front wheel, left positive
};

/// State of the vehicle at one time.
struct DriveState {
  double time_s = 0;           ///< since the start
  PlanarPose pose;             ///< pose of the origin
  double speed_m_s = 0;        ///< speed of the origin; negative: backwards
  double turn_rate_rad_s = 0;  ///< rate of the heading
  double steering_rad = 0;     ///< Ackermann
};

/// Limits that prevented the execution of a command.
struct DriveLimited {
  bool speed = false;         ///< beyond max_speed_m_s
  bool turn = false;          ///< beyond max_turn_rate_rad_s or max_steering_rad
  bool acceleration = false;  ///< max_acceleration_m_s2 prevents the speed within the step
  bool turn_change =
      false;  ///< the limit of the turn or steering acceleration does so for the turn

  /// True if any limit was active.
  bool any() const { return speed || turn || acceleration || turn_change; }
};

/// Default: no noise, exactly known wheels.
struct LIBOCC_API DriveNoise {
  double drive =
      0;  ///< deviation of the wheels from the command, reported by the odometry [sqrt(m)]
  double slip = 0;           ///< slip of the wheels, not reported [sqrt(m)]
  double slip_share = 0;     ///< constant share of each wheel's travel that is lost
  double sideways_slip = 0;  ///< lateral slip of the origin [sqrt(m)]
  double odometry = 0;       ///< noise of the reported wheel travel [sqrt(m)]
  double left_scale = 1;     ///< reported over true travel of the left wheel
  double right_scale = 1;    ///< reported over true travel of the right wheel
  double scale_sigma = 0;  ///< standard deviation of both scales in the reported covariance; fully
                           ///< correlated within a step

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Size, limits and errors of a vehicle.
struct LIBOCC_API Vehicle {
  Drive drive = Drive::differential;  ///< kinematics
  double track_m = 0.4;               ///< distance between the two unsteered wheels
  double wheelbase_m = 0.5;           ///< Ackermann: distance from the origin to the front axle
  double radius_m = 0.3;     ///< radius of a disc about the origin that contains the vehicle
  double max_speed_m_s = 1;  ///< also backwards
  double max_acceleration_m_s2 = 0.5;       ///< also for braking
  double max_turn_rate_rad_s = 1.5;         ///< differential drive
  double max_turn_acceleration_rad_s2 = 5;  ///< differential drive
  double max_steering_rad = 0.6;            ///< Ackermann; below pi/2
  double max_steering_rate_rad_s = 1.5;     ///< Ackermann
  DriveNoise noise;                         ///< errors of wheels and odometry; none by default

  /// Radius of the sharpest possible curve; 0 for a differential drive.
  double min_radius_m() const;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Result of one time step.
struct DriveStep {
  DriveState state;         ///< true state
  PlanarOdometry odometry;  ///< reported motion with covariance
  DriveLimited limited;     ///< limits that the command exceeded
};

/// Advances the state by dt_s. Draws the same count of numbers from `random` for any noise. Throws
/// std::invalid_argument if the vehicle is invalid, dt_s is not positive, or the command or the
/// state is not finite.
LIBOCC_API DriveStep drive(const Vehicle& vehicle, const DriveState& state,
                           const DriveCommand& command, double dt_s, Random& random);

/// Returns the command for a curvature [1/m, left positive] at a speed, within the vehicle's
/// limits. A curvature beyond the limit is clipped; a turn rate beyond the limit reduces the speed.
LIBOCC_API DriveCommand curve_command(const Vehicle& vehicle, double speed_m_s,
                                      double curvature_1_m);

}  // namespace occ
