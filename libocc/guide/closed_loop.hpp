// SPDX-License-Identifier: Apache-2.0
// A vehicle that drives a route by its lamps: world -> rendered image -> estimate -> controller ->
// world. Wheels turn, images come, and commands go out on one clock; the controller knows the
// estimate alone, the records know the truth. Everything that may go wrong is an option, and off.
//
// At the route's end the vehicle docks, where the route has a dock, else it stops. Without a pose
// (searching, lost) it stands still and looks.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
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

/// A lamp that is dark for a while.
struct LampFailure {
  int lamp = 0;  ///< its id
  double from_s = 0, to_s = std::numeric_limits<double>::infinity();
};

/// Odometry that says something else than the wheels did, its covariance as ever.
struct OdometryLie {
  double from_s = 0, to_s = 0;
  double scale = 1;            ///< of the length
  double turn_rate_rad_s = 0;  ///< added
};

/// The vehicle is lifted to another pose; nobody says so.
struct Kidnapping {
  double at_s = 0;
  PlanarPose to;
};

/// From then on the camera's clock is ahead by this much (more).
struct ClockJump {
  double at_s = 0, by_s = 0;
};

struct LIBOCC_API LoopFaults {
  double latency_s = 0;     ///< from an image's capture to its arrival
  double frame_loss = 0;    ///< probability of each image
  double frame_repeat = 0;  ///< probability that an image comes twice
  std::vector<LampFailure> lamp_failures;
  std::vector<OdometryLie> odometry_lies;
  std::vector<Kidnapping> kidnappings;
  std::vector<ClockJump> clock_jumps;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

enum class LoopEstimation {
  tracker,  ///< track/tracker.hpp, on a floor
  locate,   ///< each image for itself, with a prior: three lamps are needed
};

enum class Follower { pure_pursuit, stanley };

struct LIBOCC_API LoopOptions {
  Vehicle vehicle;
  double vehicle_height_m = 0.5;  ///< for boxes that it may drive under
  Follower follower = Follower::pure_pursuit;
  PurePursuitOptions pure_pursuit;
  StanleyOptions stanley;
  DockOptions docking;
  LoopEstimation estimation = LoopEstimation::tracker;
  TrackerOptions tracker = floor_tracker();
  Eigen::Vector3d camera_place_m = Eigen::Vector3d(0, 0, 1.5);  ///< on the vehicle, above the floor
  double camera_pan_rad = 0, camera_tilt_rad = 0;               ///< see guide/mount.hpp
  std::optional<PanTiltPlan> pan_tilt;  ///< instead: by the way along the route
  double pan_tilt_rate_rad_s = 2;       ///< each axis goes no faster after the plan
  double frame_rate_hz = 30;
  double control_rate_hz = 100;
  /// When images come so much later or earlier than they used to, their clock has jumped, and their
  /// arrival tells their time; infinity: their clock is believed.
  double clock_guard_s = 0.1;
  bool image_noise = true;
  std::optional<PlanarPose> start;                      ///< the true one; none: the route's begin
  double start_sigma_m = 0.02, start_sigma_rad = 0.02;  ///< the estimate's first error, and what
                                                        ///< it is told of that
  double max_s = 600;                                   ///< the run ends
  double max_lost_s = 10;  ///< without a pose for so long: the run ends
  LoopFaults faults;
  std::uint64_t seed = 0;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

enum class LoopOutcome { arrived, collision, lost, out_of_time };

LIBOCC_API const char* to_string(LoopOutcome outcome);

/// What was at the end of one control step.
struct LoopRecord {
  double time_s = 0;
  PlanarPose truth;
  EstimatedPose estimate;
  double along_m = 0;      ///< of the truth on the route
  double deviation_m = 0;  ///< of the truth, to the left of the route
  DriveCommand command;
  DriveLimited limited;
  double pan_rad = 0, tilt_rad = 0;
  bool docking = false;
  int frames = 0;  ///< that arrived in this step
};

/// One image, when it has arrived.
struct LoopFrame {
  double captured_s = 0;  ///< true time
  double arrived_s = 0;
  bool lost = false;  ///< it never did
  TrackerState state = TrackerState::searching;
  int lamps_in_view = 0;  ///< whole, by the truth
  int lamps_used = 0;
  double nis = 0;
  int nis_dof = 0;
  bool relocated = false;
  double clock_jumped_s = 0;  ///< before this image, as far as was noticed
  double taken_s = 0;         ///< by the estimator, on this machine
};

struct LoopMetrics {
  double duration_s = 0, driven_m = 0;
  double cross_track_mean_m = 0;  ///< of its magnitude, while the route is followed
  double cross_track_rmse_m = 0, cross_track_max_m = 0;
  double position_rmse_m = 0, position_max_m = 0;  ///< of the estimate, from the first image on
  double heading_rmse_rad = 0, heading_max_rad = 0;
  PlanarPose final_error;  ///< the truth in the frame of the dock, or of the route's end
  double final_position_error_m = 0, final_heading_error_rad = 0;  ///< magnitudes
  int frames = 0;                                                  ///< captured
  double availability = 0;      ///< share of them that were tracked
  double three_lamps = 0;       ///< share of them whose pose was made of three lamps or more
  double longest_outage_s = 0;  ///< between images that were tracked, beyond the frames' period
  double lost_s = 0;            ///< without a pose, the start's search included
  int relocations = 0;
  int clock_jumps = 0;     ///< that were noticed
  double nees = 0;         ///< mean over the steps with a pose; 3 is expected
  double nis_per_dof = 0;  ///< over all images; 1 is expected
  double frame_mean_s = 0, frame_median_s = 0, frame_p99_s = 0;  ///< on this machine
  int limited_steps = 0;  ///< the vehicle could not do what was asked: speed or turn
};

struct LoopResult {
  LoopOutcome outcome = LoopOutcome::out_of_time;
  std::string message;  ///< what ended it
  std::vector<LoopRecord> records;
  std::vector<LoopFrame> frames;
  LoopMetrics metrics;
};

/// Instead of LoopOptions::estimation: anybody's.
using MakeEstimator = std::function<std::unique_ptr<LoopEstimator>(const Scene&)>;

/// Called after each control step; false ends the run (out_of_time).
using LoopObserver = std::function<bool(const LoopRecord&)>;

/// `scene.camera` is the vehicle's. The same seed gives the same run, times on this machine apart.
/// Throws std::invalid_argument when scene or options do not validate, the route is not free, a
/// failing lamp is none of the scene's, or the start is in a wall.
LIBOCC_API LoopResult closed_loop(const Scene& scene, const Route& route,
                                  const LoopOptions& options = {},
                                  const MakeEstimator& make_estimator = {},
                                  const LoopObserver& observer = {});

}  // namespace occ
