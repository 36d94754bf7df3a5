// SPDX-License-Identifier: Apache-2.0
// Measurements of a body's motion other than images: odometry, inertial measurement unit.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Motion of a body between two times. The defaults mean no motion and no noise.
struct Odometry {
  double from_s = 0, to_s = 0;           ///< begin and end of the step
  Rigid3 to_from_from;                   ///< body frame at to_s from body frame at from_s
  Matrix6 covariance = Matrix6::Zero();  ///< covariance of to_from_from, see rigid.hpp
};

/// Motion on a floor, as measured by wheels.
struct PlanarOdometry {
  double from_s = 0, to_s = 0;  ///< begin and end of the step
  PlanarPose increment;         ///< pose at to_s in the body frame at from_s
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  ///< [x, y, heading], in the body frame at from_s
};

/// Inertial measurement along the body's axes. At rest an accelerometer reads +9.81 m/s^2 upwards.
struct ImuSample {
  double time_s = 0;                                          ///< time of the measurement
  Eigen::Vector3d turn_rate_rad_s = Eigen::Vector3d::Zero();  ///< gyroscope; about the body's axes
  /// Accelerometer: specific force along the body's axes.
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();
};

}  // namespace occ
