// SPDX-License-Identifier: Apache-2.0
// Prior knowledge of a pose, independent of the image. Each part is optional and has its own
// standard deviation.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// A predicted pose, such as a tracker's last pose moved to the present time.
struct PriorPose {
  Rigid3 cam_from_world;  ///< predicted pose
  Matrix6 covariance =
      Matrix6::Identity();  ///< covariance of the left perturbation (geometry/rigid.hpp)
};

/// A prior linearised at a pose: residuals over their standard deviations, and their derivatives
/// with respect to the left perturbation of cam_from_world.
struct PriorRows {
  static constexpr int max_rows = 14;  ///< all parts together
  /// One row per known value, over its standard deviation.
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_rows, 1> residuals;
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, max_rows, 6> jacobian;  ///< as many rows as residuals
};

/// Knowledge of a camera's pose; empty by default.
struct LIBOCC_API Prior {
  std::optional<Eigen::Vector3d> position_m;  ///< position of the camera in the world
  double position_sigma_m = 0.5;              ///< per axis
  std::optional<Eigen::Vector3d>
      position_sigmas_m;              ///< instead: along x, y, z; infinite where nothing is known
  std::optional<double> height_m;     ///< z coordinate of the camera, such as on a vehicle
  double height_sigma_m = 0.05;       ///< standard deviation of height_m
  std::optional<double> heading_rad;  ///< as defined by occ::heading_rad
  double heading_sigma_rad = 0.35;    ///< standard deviation of heading_rad
  std::optional<Eigen::Vector3d>
      gravity_in_cam;                  ///< unit vector pointing down, camera frame (accelerometer)
  double gravity_sigma_rad = 0.02;     ///< standard deviation of the direction, per axis
  std::optional<PriorPose> last_pose;  ///< predicted pose with covariance

  /// True if no part is set.
  bool empty() const {
    return !position_m && !height_m && !heading_rad && !gravity_in_cam && !last_pose;
  }

  /// position_sigmas_m, or position_sigma_m along all axes.
  Eigen::Vector3d position_sigmas() const {
    return position_sigmas_m.value_or(Eigen::Vector3d::Constant(position_sigma_m));
  }

  /// Residuals and derivatives of all parts at a pose.
  PriorRows rows(const Rigid3& cam_from_world) const;

  /// Sum of the squared residuals over their variances; 0 when empty.
  double chi2(const Rigid3& cam_from_world) const {
    return rows(cam_from_world).residuals.squaredNorm();
  }

  /// Degrees of freedom of chi2: the number of independent known values, 0 to 13.
  int dof() const;

  /// Throws std::invalid_argument naming the field and its value, or two parts that contradict each
  /// other: their chi-square is exceeded with probability 1e-6.
  void validate() const;
};

}  // namespace occ
