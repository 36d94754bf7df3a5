// SPDX-License-Identifier: Apache-2.0
// For solvers that take image points instead of bearings: the camera turned so that the mean
// bearing becomes its z axis, which keeps as wide a view as possible in front of the image plane.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/pose/problem.hpp"

namespace occ::internal::pose {

struct PinholeFrame {
  Eigen::Matrix3d turned_from_cam;  ///< rotation
  Eigen::Matrix2Xd image;           ///< (x / z, y / z) of the turned bearings

  Rigid3 cam_from_world(const Rigid3& turned_from_world) const;
};

/// Nothing when a bearing is more than 89.94 degrees from the mean bearing or not finite.
std::optional<PinholeFrame> pinhole_frame(const PoseProblem& problem);

}  // namespace occ::internal::pose
