// SPDX-License-Identifier: Apache-2.0
// What is known of a pose before the image is looked at; each part is optional and has its own
// sigma.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <optional>

#include "libocc/geometry/rigid.hpp"

namespace occ {

struct LIBOCC_API Prior {
  std::optional<Eigen::Vector3d> position_m;  ///< of the camera in the world
  double position_sigma_m = 0.5;              ///< per axis
  std::optional<double> heading_rad;          ///< as occ::heading_rad defines it
  double heading_sigma_rad = 0.35;
  std::optional<Eigen::Vector3d>
      gravity_in_cam;  ///< unit, pointing down, camera frame (an accelerometer)
  double gravity_sigma_rad = 0.02;

  bool empty() const { return !position_m && !heading_rad && !gravity_in_cam; }

  /// Residuals over their sigmas, squared and summed; 0 when empty.
  double chi2(const Rigid3& cam_from_world) const;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

}  // namespace occ
