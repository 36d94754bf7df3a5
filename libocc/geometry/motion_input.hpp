// SPDX-License-Identifier: Apache-2.0
// What is known of a body's motion beside images: wheel odometry, an inertial measurement unit.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// How a body has moved between two times. Without these numbers there is no motion, and no noise.
struct Odometry {
  double from_s = 0, to_s = 0;
  Rigid3 to_from_from;                   ///< from the body's frame at from_s to that at to_s
  Matrix6 covariance = Matrix6::Zero();  ///< of to_from_from, see geometry/rigid.hpp
};

/// The same on a floor, as wheels tell it.
struct PlanarOdometry {
  double from_s = 0, to_s = 0;
  PlanarPose increment;  ///< pose at to_s in the frame of from_s
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  ///< [x, y, heading], in the frame of from_s
};

/// Along the body's axes; an accelerometer at rest reads +9.81 m/s^2 upwards.
struct ImuSample {
  double time_s = 0;
  Eigen::Vector3d turn_rate_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();
};

}  // namespace occ
