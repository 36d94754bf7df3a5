// SPDX-License-Identifier: Apache-2.0
// Protection level of the tracked position: a bound of its horizontal error although lamps may be
// faulty (moved, misnamed, a reflection).
//
// The state of the filter depends on all images so far, and so on the faults in all of them.
// Therefore an image is also evaluated alone, without the prediction. Its position x_i has the
// protection level L, its heading the protection level H (refine/separation.hpp). Odometry moves
// this pose to x_i(t). The error of the filter's position x(t) is then at most
//
//     |x(t) - x_i(t)| + L + H |x_i(t) - x_i| + k s(t),   k = sqrt(-2 ln risk),
//
// (triangle inequality) with the standard deviation s of the odometry's errors since the image. L,
// H and k each have a third of the risk. Of the last images, that with the smallest bound is used.
// Without odometry s grows fast, so each image needs a level of its own.
//
// Odometry with errors beyond its covariance is not covered, nor is a vehicle that is moved by hand
// until the tracker reports a relocation.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/tracker.hpp"

namespace occ::internal::track {

/// Pose of one image, from its lamps alone, with the lamps' contributions.
struct SingleImage {
  double time_s = 0;
  const Refined& refined;
  Rigid3 cam_from_body;
  Matrix6 mount_covariance;  ///< part of mount and clock in that of cam_from_world
};

class LIBOCC_API IntegrityMonitor {
 public:
  explicit IntegrityMonitor(const TrackerOptions& options);

  bool is_on() const { return options_.alert_limit_m.has_value(); }

  template <class Measurement>
  void add(const Measurement& measurement) {
    if (odometry_) odometry_->add(measurement);
  }

  /// Uses the level of an image if that gives the smaller bound for the tracked position. Returns a
  /// sentence if the lamps contradict each other, else an empty text.
  std::string add(const SingleImage& image, const Eigen::Vector2d& tracked_m);
  /// Drops the images, after a jump of the pose or of the clock.
  void clear();

  /// Time of the image in use; -infinity without one.
  double since_s() const { return bound_ ? bound_->time_s : -infinity; }
  /// Level of a tracked position (x, y); infinite without an image that determines it.
  double level_m(const Eigen::Vector2d& tracked_m, double time_s) const;

 private:
  /// Levels of an image, at its pose.
  struct Bound {
    double time_s = 0;
    Eigen::Vector2d position_m;
    double level_m = 0, heading_level_rad = 0;
  };

  TrackerOptions options_;
  std::optional<Bound> bound_;
  std::optional<PlanarFilter> odometry_;  // moves the pose of the bound; empty for a body in space
};

}  // namespace occ::internal::track
