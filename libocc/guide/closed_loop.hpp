// SPDX-License-Identifier: Apache-2.0
// Closed-loop simulation of a vehicle that follows a route by means of its lamps: world -> rendered
// image -> pose estimate -> controller -> world. Motion, images and commands share one clock. The
// controller receives the estimate only; the records also contain the true state. Faults are
// options and off by default.
//
// At the end of the route the vehicle docks if the route has a dock, otherwise it stops. While the
// estimator has no pose (searching, lost), the command is zero. A predicted pose (coasting) counts
// as a pose. With an alert limit (TrackerOptions::alert_limit_m), the command is also zero while
// the protection level is above it. The run ends as `lost` after max_lost_s in one of these states.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/guide/controller.hpp"
#include "libocc/guide/docking.hpp"
#include "libocc/guide/loop_estimator.hpp"
#include "libocc/guide/pan_tilt_plan.hpp"
#include "libocc/guide/route.hpp"
#include "libocc/guide/vehicle.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// A lamp that is off for a while.
struct LampFailure {
  int lamp = 0;  ///< id of the lamp
  /// Off from `from_s` until `to_s`; default: from the start to the end.
  double from_s = 0, to_s = std::numeric_limits<double>::infinity();
};

/// Interval with a gross error of the odometry; the reported covariance does not include it.
struct OdometryFault {
  double from_s = 0, to_s = 0;  ///< begin and end of the interval
  double scale = 1;             ///< factor of the reported length
  double turn_rate_rad_s = 0;   ///< added to the reported turn rate
};

/// Moves the vehicle to another pose without any odometry (kidnapped-robot problem).
struct Kidnapping {
  double at_s = 0;  ///< time of the move
  PlanarPose to;    ///< true pose after it
};

/// Sets the camera's clock forward; jumps add up.
struct ClockJump {
  double at_s = 0, by_s = 0;  ///< time of the jump, and its size
};

/// Disturbances of a run; none by default.
struct LIBOCC_API LoopFaults {
  double latency_s = 0;                    ///< delay from the capture of an image to its arrival
  double frame_loss = 0;                   ///< probability that an image is lost
  double frame_repeat = 0;                 ///< probability that an image arrives twice
  std::vector<LampFailure> lamp_failures;  ///< lamps that are off for a while
  std::vector<OdometryFault> odometry_faults;  ///< gross errors of the odometry
  std::vector<Kidnapping> kidnappings;         ///< moves without odometry
  std::vector<ClockJump> clock_jumps;          ///< jumps of the camera's clock

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Differences of the simulated world from the scene and the options, which the estimator assumes;
/// none by default.
struct LIBOCC_API WorldErrors {
  /// Standard deviation of the errors of all lamps' positions along each axis, drawn from the seed.
  double map_sigma_m = 0;
  /// Errors of the camera's parameters by name, e.g. {"k1", -0.005}: true minus assumed value.
  std::map<std::string, double> lens;
  /// Rotation vector of the camera from its assumed mount, in its own axes.
  Eigen::Vector3d mount_rotation_rad = Eigen::Vector3d::Zero();
  /// Its shift, likewise.
  Eigen::Vector3d mount_shift_m = Eigen::Vector3d::Zero();
  /// Time stamps minus capture times. Images arrive when they are stamped or later.
  double clock_s = 0;
  /// Amplitudes of the floor's waves (of roll and pitch, and of the height), and their length.
  double floor_tilt_rad = 0, floor_height_m = 0, floor_wave_m = 1;
  double exposure = 1;         ///< true over assumed exposure time
  double ambient_w_m2 = 0;     ///< further irradiance of the sensor by other light than the lamps'
  double ambient_flicker = 0;  ///< its relative amplitude, the same in all lines of an image
  double flicker_hz = 100;     ///< its frequency

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Source of the pose estimate.
enum class LoopEstimation {
  tracker,  ///< tracker on a floor, see track/tracker.hpp
  locate,   ///< locate() for each image, with a prior; needs three lamps
};

/// Controller on the route; see guide/controller.hpp.
enum class Follower {
  pure_pursuit,  ///< regulated pure pursuit
  stanley,       ///< Stanley's law
};

/// Options of closed_loop().
struct LIBOCC_API LoopOptions {
  Vehicle vehicle;                             ///< limits, size and errors of the vehicle
  double vehicle_height_m = 0.5;               ///< boxes above this height do not block the vehicle
  Follower follower = Follower::pure_pursuit;  ///< controller that is used until docking begins
  PurePursuitOptions pure_pursuit;             ///< used with Follower::pure_pursuit
  StanleyOptions stanley;                      ///< used with Follower::stanley
  DockOptions docking;                         ///< used at the end of a route with a dock
  /// Ignored if a factory of estimators is given.
  LoopEstimation estimation = LoopEstimation::tracker;
  TrackerOptions tracker = floor_tracker();  ///< used with LoopEstimation::tracker
  Eigen::Vector3d camera_place_m =
      Eigen::Vector3d(0, 0, 1.5);                  ///< position on the vehicle, z above the floor
  double camera_pan_rad = 0, camera_tilt_rad = 0;  ///< see guide/mount.hpp
  std::optional<PanTiltPlan>
      pan_tilt;  ///< replaces the fixed angles, as a function of the distance along the route
  double pan_tilt_rate_rad_s = 2;  ///< maximum rate of each axis while it follows the plan
  double frame_rate_hz = 30;       ///< images per second
  double control_rate_hz = 100;    ///< commands per second; each step integrates the motion
  /// Change of the transport delay of images that indicates a jump of their clock; their capture
  /// time is then derived from their arrival. Infinity: time stamps are always used.
  double clock_guard_s = 0.1;
  bool image_noise = true;          ///< false: images without shot and read noise
  std::optional<PlanarPose> start;  ///< true pose at the start; default: begin of the route
  /// Standard deviations of the initial pose error, also given to the estimator.
  double start_sigma_m = 0.02, start_sigma_rad = 0.02;
  double max_s = 600;      ///< maximum duration of the run
  double max_lost_s = 10;  ///< maximum time without a pose or with an alert; then the run ends
  LoopFaults faults;       ///< disturbances; none by default
  WorldErrors world;       ///< differences of the simulated world; none by default
  std::uint64_t seed = 0;  ///< for image noise, wheel errors and lost images

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Reason for the end of a run.
enum class LoopOutcome {
  arrived,      ///< the vehicle docked, or stopped at the route's end
  collision,    ///< the vehicle touched a wall or box
  lost,         ///< no pose for max_lost_s
  out_of_time,  ///< max_s elapsed, or the observer ended the run
};

/// The enumerator's name, e.g. "arrived".
LIBOCC_API const char* to_string(LoopOutcome outcome);

/// State at the end of one control step.
struct LoopRecord {
  double time_s = 0;                 ///< since the start of the run
  PlanarPose truth;                  ///< true pose of the vehicle
  EstimatedPose estimate;            ///< input of the controller
  double along_m = 0;                ///< distance of the true position along the route
  double deviation_m = 0;            ///< offset of the true position to the left of the route
  DriveCommand command;              ///< output of the controller
  DriveLimited limited;              ///< limits that the command exceeded
  double pan_rad = 0, tilt_rad = 0;  ///< angles of the camera; see guide/mount.hpp
  bool docking = false;              ///< true after the route was left for the dock
  int frames = 0;                    ///< number of images that arrived in this step
  bool alert = false;  ///< the protection level of the estimate is above the alert limit
};

/// An image with the result of its processing.
struct LoopFrame {
  double captured_s = 0;                         ///< true time
  double arrived_s = 0;                          ///< time at which the estimator received it
  bool lost = false;                             ///< true for an image that never arrives
  TrackerState state = TrackerState::searching;  ///< state of the estimator after the image
  int lamps_in_view = 0;                         ///< lamps completely inside the true image
  int lamps_used = 0;                            ///< lamps that the estimate was computed from
  double nis = 0;                                ///< normalised innovation squared
  int nis_dof = 0;                               ///< degrees of freedom of `nis`; 0 without lamps
  bool relocated = false;     ///< the pose jumped out of the gate of its prediction
  double clock_jumped_s = 0;  ///< clock jump detected before this image
  double taken_s = 0;         ///< processing time of the estimator on this machine
};

/// Statistics of a whole run.
struct LoopMetrics {
  double duration_s = 0, driven_m = 0;  ///< simulated time, and distance that the origin travelled
  double cross_track_mean_m = 0;        ///< mean magnitude while the route is followed
  /// Root mean square and maximum of the true deviation.
  double cross_track_rmse_m = 0, cross_track_max_m = 0;
  /// Error of the estimated position, from the first image on.
  double position_rmse_m = 0, position_max_m = 0;
  double position_sigma_m = 0;  ///< stated for it: root of the mean trace of its covariance
  /// Error of the estimate, from the first image on.
  double heading_rmse_rad = 0, heading_max_rad = 0;
  PlanarPose final_error;  ///< true pose at the end, relative to the dock or the route's end
  double final_position_error_m = 0, final_heading_error_rad = 0;  ///< magnitudes
  int frames = 0;                                                  ///< number captured
  double availability = 0;      ///< share of the images in state tracking
  double three_lamps = 0;       ///< share of the images whose pose uses three lamps or more
  double longest_outage_s = 0;  ///< longest time between tracked images, less the frame period
  double lost_s = 0;            ///< time without a pose, the initial search included
  double alert_s = 0;           ///< time with LoopRecord::alert
  /// Median protection level of the steps that have one; 0 without an alert limit.
  double protection_level_m = 0;
  double misleading_s = 0;  ///< time in which the error exceeds the protection level
  int relocations = 0;      ///< number of frames with LoopFrame::relocated
  int clock_jumps = 0;      ///< number of jumps detected
  double nees =
      0;  ///< normalised estimation error squared, mean over the steps with a pose; expected: 3
  double nis_per_dof = 0;  ///< normalised innovation squared over all images; expected: 1
  /// Processing time per image on this machine.
  double frame_mean_s = 0, frame_median_s = 0, frame_p99_s = 0;
  int limited_steps =
      0;  ///< steps in which the command exceeded the vehicle's speed or turn limits
};

/// Outcome and history of a run.
struct LoopResult {
  LoopOutcome outcome = LoopOutcome::out_of_time;  ///< reason for the end of the run
  std::string message;                             ///< reason for the end of the run
  std::vector<LoopRecord> records;                 ///< one per control step
  std::vector<LoopFrame> frames;                   ///< one per captured image
  LoopMetrics metrics;                             ///< statistics of records and frames
};

/// Factory of an estimator that replaces LoopOptions::estimation.
using MakeEstimator = std::function<std::unique_ptr<LoopEstimator>(const Scene&)>;

/// Called after each control step; returning false ends the run (out_of_time).
using LoopObserver = std::function<bool(const LoopRecord&)>;

/// Runs the simulation. `scene.camera` is the vehicle's camera. The same seed gives the same run,
/// except for processing times. Throws std::invalid_argument if the scene or the options are
/// invalid, the route is not free, a failing lamp is not in the scene, the camera does not have a
/// parameter of `world.lens`, or the start is inside a wall.
LIBOCC_API LoopResult closed_loop(const Scene& scene, const Route& route,
                                  const LoopOptions& options = {},
                                  const MakeEstimator& make_estimator = {},
                                  const LoopObserver& observer = {});

}  // namespace occ
