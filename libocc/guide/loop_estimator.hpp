// SPDX-License-Identifier: Apache-2.0
// What a closed loop asks of whoever estimates the vehicle's pose, and who does so.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/track/tracker.hpp"

namespace occ {

struct EstimatedPose {
  double time_s = 0;
  PlanarPose pose;  ///< while searching or lost: the last one there was
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< see geometry/planar_pose.hpp
  TrackerState state = TrackerState::searching;
  std::string reason;  ///< empty while all is as expected
  int lamps = 0;       ///< that the last image's pose was made of
  double nis = 0;      ///< of the last image
  int nis_dof = 0;
  bool relocated = false;  ///< the last image was where it was not expected

  bool has_pose() const {
    return state == TrackerState::tracking || state == TrackerState::coasting;
  }
};

struct CapturedFrame {
  ImageView image;
  double captured_s = 0;  ///< by the camera's clock
  double now_s = 0;       ///< when it arrives
  Rigid3 cam_from_body;   ///< when it was captured
};

class LIBOCC_API LoopEstimator {
 public:
  virtual ~LoopEstimator() = default;
  virtual void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) = 0;
  virtual void add_odometry(const PlanarOdometry& step) = 0;
  virtual EstimatedPose add_image(const CapturedFrame& frame) = 0;
  /// Predicted to a time.
  virtual EstimatedPose at(double time_s) const = 0;
};

/// A tracker's options for a vehicle on an even floor.
LIBOCC_API TrackerOptions floor_tracker();

/// Throws std::invalid_argument when scene or options do not validate, or `floor` is not set.
LIBOCC_API std::unique_ptr<LoopEstimator> make_tracker_estimator(const Scene& scene,
                                                                 const TrackerOptions& options,
                                                                 const Rigid3& cam_from_body);

/// Each image for itself by locate(), its prior what odometry has made of the image before.
LIBOCC_API std::unique_ptr<LoopEstimator> make_locate_estimator(const Scene& scene);

}  // namespace occ
