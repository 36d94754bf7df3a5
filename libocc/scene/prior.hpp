// SPDX-License-Identifier: Apache-2.0
// What is known of a pose before the image is looked at; each part is optional and has its own
// sigma.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Where a tracker expects the camera: its last pose, or where that has moved to by now.
struct PriorPose {
  Rigid3 cam_from_world;
  Matrix6 covariance = Matrix6::Identity();  ///< as geometry/rigid.hpp defines it
};

/// What a prior says of a pose, linearised: residuals over their sigmas, and their derivatives by
/// the left perturbation of cam_from_world.
struct PriorRows {
  static constexpr int most = 14;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most, 1> residuals;
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, most, 6> jacobian;
};

struct LIBOCC_API Prior {
  std::optional<Eigen::Vector3d> position_m;  ///< of the camera in the world
  double position_sigma_m = 0.5;              ///< per axis
  std::optional<Eigen::Vector3d>
      position_sigmas_m;           ///< instead: along x, y, z; infinite where nothing is known
  std::optional<double> height_m;  ///< of the camera: its z, as of one on wheels
  double height_sigma_m = 0.05;
  std::optional<double> heading_rad;  ///< as occ::heading_rad defines it
  double heading_sigma_rad = 0.35;
  std::optional<Eigen::Vector3d>
      gravity_in_cam;  ///< unit, pointing down, camera frame (an accelerometer)
  double gravity_sigma_rad = 0.02;
  std::optional<PriorPose> last_pose;

  bool empty() const {
    return !position_m && !height_m && !heading_rad && !gravity_in_cam && !last_pose;
  }

  /// position_sigmas_m, or position_sigma_m along all axes.
  Eigen::Vector3d position_sigmas() const {
    return position_sigmas_m.value_or(Eigen::Vector3d::Constant(position_sigma_m));
  }

  PriorRows rows(const Rigid3& cam_from_world) const;

  /// Residuals over their sigmas, squared and summed; 0 when empty.
  double chi2(const Rigid3& cam_from_world) const {
    return rows(cam_from_world).residuals.squaredNorm();
  }

  /// Of chi2: how many independent values are known, 0 to 13.
  int dof() const;

  /// Throws std::invalid_argument naming the field and its value, or two parts that contradict each
  /// other: further apart than once in a million by their sigmas.
  void validate() const;
};

}  // namespace occ
