// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/mount.hpp"

#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {

Rigid3 camera_on_vehicle(const Eigen::Vector3d& place_m, double pan_rad, double tilt_rad) {
  require(place_m.allFinite(), "place_m", place_m.transpose(), "finite");
  require(std::isfinite(pan_rad), "pan_rad", pan_rad, "finite");
  require(std::isfinite(tilt_rad), "tilt_rad", tilt_rad, "finite");
  const Eigen::Matrix3d body_from_cam =
      so3_exp(pan_rad * Eigen::Vector3d::UnitZ()) * so3_exp(tilt_rad * Eigen::Vector3d::UnitY());
  return {body_from_cam.transpose(), -(body_from_cam.transpose() * place_m)};
}

}  // namespace occ
