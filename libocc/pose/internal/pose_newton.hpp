// SPDX-License-Identifier: Apache-2.0
// Polishes a pose that fits its bearings exactly: Newton's method for three points, Gauss-Newton by
// QR for more, on the residuals across the bearings. These residuals depend to first order on a
// small height of the points over a line, and on the depth of a narrow view. The distance equations
// of P3P and the normal equations lose these digits.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::pose {

/// Largest angle [rad] between a bearing (unit columns) and the direction to its point, to first
/// order. Infinite when a point is not in front along its bearing. `origins`: start points of the
/// bearings; empty for one camera.
LIBOCC_API double misfit_rad(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
                             const Eigen::Matrix3Xd& origins, const Rigid3& pose);

/// Improves the pose while its misfit falls, and once more after that, at most max_steps times.
/// Requires three columns or more.
LIBOCC_API void polish_pose(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
                            const Eigen::Matrix3Xd& origins, int max_steps, Rigid3& pose);

}  // namespace occ::internal::pose
