// SPDX-License-Identifier: Apache-2.0
// Predicts for poses on the floor which lamps are completely in view, the power received from all
// lamps, and the accuracy of a pose from one image.
//
// The accuracy is the Cramer-Rao bound of x, y and heading from the lamps' centres,
//
//   covariance = (sum over lamps J^T J / sigma_px^2 + prior of the heading)^-1,
//
// with the derivative J of a lamp's pixel by the pose; height, roll and pitch are fixed by the
// floor. With a heading known from odometry, one lamp suffices for a position.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Options of visibility().
struct LIBOCC_API VisibilityOptions {
  Eigen::Vector3d camera_place_m = Eigen::Vector3d(0, 0, 1.5);  ///< position on the vehicle
  double camera_pan_rad = 0, camera_tilt_rad = 0;               ///< see guide/mount.hpp
  double margin_px =
      4;  ///< minimum distance of a lamp's rim from the image border, for blur by the lens
  double sigma_px = 0.1;            ///< error of a lamp's centre in the image, each axis
  double heading_sigma_rad = 0.01;  ///< prior knowledge of the heading; infinity: none

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Lamps in view from one pose, and the accuracy of an image there.
struct Visibility {
  std::vector<int> lamps;  ///< ids of the lamps completely in view, in the scene's order
  double power_w = 0;      ///< power of all lamps through the lens; see simulate/received_power.hpp
  /// Root of the trace of the position covariance; infinite if the image does not determine the
  /// position.
  double position_sigma_m = std::numeric_limits<double>::infinity();
  /// Infinite if prior and image do not determine it.
  double heading_sigma_rad = std::numeric_limits<double>::infinity();
};

/// Computes the visibility for each pose, in parallel. Nothing is visible outside the room or
/// inside a box. Throws std::invalid_argument if the scene or the options are invalid or a pose is
/// not finite.
LIBOCC_API std::vector<Visibility> visibility(const Scene& scene,
                                              const std::vector<PlanarPose>& poses,
                                              const VisibilityOptions& options = {});
/// Visibility of one pose.
LIBOCC_API Visibility visibility(const Scene& scene, const PlanarPose& pose,
                                 const VisibilityOptions& options = {});

}  // namespace occ
