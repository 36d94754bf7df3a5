// SPDX-License-Identifier: Apache-2.0
// Rotations in three dimensions: exponential, logarithm, left Jacobian. Rotation vectors are in
// radians. Every function is accurate to rounding for any angle; small angles use series.
// Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics",
// arXiv:1812.01537, eqs (132)-(146).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"

namespace occ {

/// Cross-product matrix: skew(a) * b == a x b.
LIBOCC_API Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// z component of the cross product of two vectors in the plane z = 0.
inline double cross_2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Rotation matrix of a rotation vector (Rodrigues).
LIBOCC_API Eigen::Matrix3d so3_exp(const Eigen::Vector3d& rotation_rad);

/// Rotation vector of a rotation matrix, |result| <= pi; stable at 0 and at pi.
LIBOCC_API Eigen::Vector3d so3_log(const Eigen::Matrix3d& rotation);

/// J with exp(w + dw) == exp(J dw) exp(w) to first order.
LIBOCC_API Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& rotation_rad);

/// The rotation by the smallest angle that turns the direction `from` into the direction `to`; of
/// opposite directions, one of them.
LIBOCC_API Eigen::Matrix3d shortest_rotation(const Eigen::Vector3d& from,
                                             const Eigen::Vector3d& to);

/// The rotation matrix nearest to m in the Frobenius norm (det +1).
LIBOCC_API Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace occ
