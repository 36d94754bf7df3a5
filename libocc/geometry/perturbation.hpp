// SPDX-License-Identifier: Apache-2.0
// Derivatives of the left perturbation that geometry/rigid.hpp defines.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// d difference(to, from) / d (left perturbation of `to`), as a function of that difference.
LIBOCC_API Matrix6 d_difference(const Vector6& delta);

/// d (left perturbation of body_from_world) / d [x, y, heading, roll, pitch, height], the last
/// three in the axes of an upright body. The columns are orthonormal: the transpose is the inverse.
LIBOCC_API Matrix6 planar_perturbation(const PlanarPose& pose);

/// Covariance of [x, y, heading] from the covariance of an upright body's body_from_world.
LIBOCC_API Eigen::Matrix3d planar_covariance(const PlanarPose& pose, const Matrix6& covariance);

}  // namespace occ
