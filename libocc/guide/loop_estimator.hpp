// SPDX-License-Identifier: Apache-2.0
// Interface of the pose estimator in a closed loop, and two implementations.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/track/tracker.hpp"

namespace occ {

/// Pose of the vehicle as the controller receives it.
struct EstimatedPose {
  double time_s = 0;  ///< time at which the pose holds
  PlanarPose pose;    ///< last known pose while searching or lost
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< see geometry/planar_pose.hpp
  TrackerState state = TrackerState::searching;          ///< see track/tracker.hpp
  std::string reason;      ///< explanation of the state; empty if normal
  int lamps = 0;           ///< lamps used for the pose of the last image
  double nis = 0;          ///< normalised innovation squared of the last image
  int nis_dof = 0;         ///< degrees of freedom of `nis`; 0 without lamps
  bool relocated = false;  ///< the last image relocalised the vehicle
  /// Bound of the horizontal error of `pose`, see Tracker::protection_level_m(); infinite: unknown.
  double protection_level_m = std::numeric_limits<double>::infinity();

  /// True while tracking or coasting.
  bool has_pose() const {
    return state == TrackerState::tracking || state == TrackerState::coasting;
  }
};

/// An image on its way to the estimator.
struct CapturedFrame {
  ImageView image;        ///< not copied: valid during the call
  double captured_s = 0;  ///< time stamp of the camera's clock
  double now_s = 0;       ///< time of arrival
  Rigid3 cam_from_body;   ///< at the time of capture
};

/// Interface of an estimator in closed_loop(); derive from it to test another one.
class LIBOCC_API LoopEstimator {
 public:
  virtual ~LoopEstimator() = default;
  /// Sets the initial pose with its covariance; called once, before all others.
  virtual void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) = 0;
  /// Adds one step of wheel odometry; steps are consecutive.
  virtual void add_odometry(const PlanarOdometry& step) = 0;
  /// Adds an image and returns the pose at the time of its arrival.
  virtual EstimatedPose add_image(const CapturedFrame& frame) = 0;
  /// Predicts the pose at a time.
  virtual EstimatedPose at(double time_s) const = 0;
};

/// Options of a tracker for a vehicle on an even floor.
LIBOCC_API TrackerOptions floor_tracker();

/// Estimator with a tracker. Throws std::invalid_argument if the scene or the options are invalid,
/// or `floor` is not set.
LIBOCC_API std::unique_ptr<LoopEstimator> make_tracker_estimator(const Scene& scene,
                                                                 const TrackerOptions& options,
                                                                 const Rigid3& cam_from_body);

/// Estimator that calls locate() for each image; the prior is the previous pose moved by odometry.
LIBOCC_API std::unique_ptr<LoopEstimator> make_locate_estimator(const Scene& scene);

}  // namespace occ
