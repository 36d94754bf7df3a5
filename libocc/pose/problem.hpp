// SPDX-License-Identifier: Apache-2.0
// What a pose solver is given: directions in which known points are seen.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Column i of each matrix belongs to point i. For a camera rig, "camera" is the rig's frame.
struct PoseProblem {
  Eigen::Matrix3Xd bearings;  ///< unit, camera frame
  Eigen::Matrix3Xd points;    ///< world frame [m]
  Eigen::Matrix3Xd origins;   ///< where each bearing starts, camera frame [m]: several cameras on a
                              ///< rig; empty when all start at the camera's centre
  std::optional<Eigen::Vector3d> up_in_cam;  ///< world's Z in the camera's frame (unit), when known

  int size() const { return static_cast<int>(points.cols()); }
};

}  // namespace occ
