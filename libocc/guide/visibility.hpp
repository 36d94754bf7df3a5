// SPDX-License-Identifier: Apache-2.0
// What a vehicle would see from a place of the floor, before it has been there: which lamps are
// wholly in view, how much of their light the lens takes in, and how well one image of them would
// tell the place. The bound is Cramer and Rao's for the pose on the floor, x, y and heading, from
// the lamps' centres,
//
//   covariance = (sum over lamps J^T J / sigma_px^2 + prior of the heading)^-1,
//
// J: derivative of a lamp's pixel by the pose; height, roll and pitch are the floor's. What
// odometry keeps of the heading from image to image makes one lamp enough for a place.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct LIBOCC_API VisibilityOptions {
  Eigen::Vector3d camera_place_m = Eigen::Vector3d(0, 0, 1.5);  ///< on the vehicle
  double camera_pan_rad = 0, camera_tilt_rad = 0;               ///< see guide/mount.hpp
  double margin_px = 4;             ///< a lamp's rim is so far within the image: the lens blurs it
  double sigma_px = 0.1;            ///< of a lamp's centre in the image, each axis
  double heading_sigma_rad = 0.01;  ///< known beside the image; infinity: nothing

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct Visibility {
  std::vector<int> lamps;  ///< ids of those wholly in view, in the scene's order
  double power_w = 0;      ///< of all lamps through the lens; see simulate/received_power.hpp
  /// Root of the trace of the place's covariance; infinite where the image does not tell it.
  double position_sigma_m = std::numeric_limits<double>::infinity();
  double heading_sigma_rad = std::numeric_limits<double>::infinity();
};

/// For each pose, on all processors. Places outside the room or inside a box see nothing. Throws
/// std::invalid_argument when scene or options do not validate or a pose is not finite.
LIBOCC_API std::vector<Visibility> visibility(const Scene& scene,
                                              const std::vector<PlanarPose>& poses,
                                              const VisibilityOptions& options = {});
LIBOCC_API Visibility visibility(const Scene& scene, const PlanarPose& pose,
                                 const VisibilityOptions& options = {});

}  // namespace occ
