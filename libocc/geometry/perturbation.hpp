// SPDX-License-Identifier: Apache-2.0
// Derivatives of the left perturbation that geometry/rigid.hpp defines.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/geometry/planar_pose.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// d difference(to, from) / d (left perturbation of `to`), of that difference.
LIBOCC_API Matrix6 d_difference(const Vector6& delta);

/// d (left perturbation of body_from_world) / d [x, y, heading], then by roll, pitch and height in
/// the axes of an upright body. Orthonormal columns: the transpose is the inverse.
LIBOCC_API Matrix6 planar_perturbation(const PlanarPose& pose);

/// Of [x, y, heading], from that of an upright body's body_from_world.
LIBOCC_API Eigen::Matrix3d planar_covariance(const PlanarPose& pose, const Matrix6& covariance);

}  // namespace occ
