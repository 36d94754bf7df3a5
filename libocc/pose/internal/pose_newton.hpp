// SPDX-License-Identifier: Apache-2.0
// Internal: the last digits of a pose that fits its bearings exactly: Newton's method
// (Gauss-Newton's by QR for more than three points) on the residuals across the bearings. Unlike
// the equations of the distances, and the normal equations, these see a small height over a line,
// or the depth of a narrow view, to first order.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::pose {

/// Largest angle [rad] between a bearing (unit columns) and the direction to its point, to first
/// order; infinite when a point is not in front along its bearing. `origins`: where the bearings
/// start; empty for one camera.
double misfit_rad(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
                  const Eigen::Matrix3Xd& origins, const Rigid3& pose);

/// Improves the pose while its misfit falls, and once more, at most max_steps times. Three columns
/// or more.
void sharpen(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
             const Eigen::Matrix3Xd& origins, int max_steps, Rigid3& pose);

}  // namespace occ::internal::pose
