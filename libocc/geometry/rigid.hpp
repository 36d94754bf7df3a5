// SPDX-License-Identifier: Apache-2.0
// Rigid transforms. `cam_from_world` converts a point from the world frame to the camera frame;
// transforms are chained as `d_from_b = d_from_c * c_from_b`.
//
// Covariance of a transform (6x6): order [rotation, translation], *left* perturbation
//     T(delta) : R -> exp(delta_rot) R,  t -> exp(delta_rot) t + delta_trans.
// in the *target* frame: a transformed point moves by delta_rot x (R p + t) + delta_trans.
// World: right-handed, metres, Z up. Camera: x right, y down, z forward.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"

namespace occ {

using Vector6 = Eigen::Matrix<double, 6, 1>;  ///< [rotation, translation]
/// Rows and columns in the order [rotation, translation].
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Rotation and translation: p_target = rotation * p_source + translation.
struct Rigid3 {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, determinant +1
  /// Source frame's origin in the target frame [m].
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  /// Point in the target frame of a point in the source frame [m].
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  /// Chain of transforms: c_from_a = c_from_b * b_from_a.
  Rigid3 operator*(const Rigid3& b_from_a) const {
    return {rotation * b_from_a.rotation, rotation * b_from_a.translation + translation};
  }
  /// Transform from the target frame to the source frame.
  Rigid3 inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
  /// Origin of the target frame in the source frame: for `cam_from_world`, the camera's centre in
  /// the world.
  Eigen::Vector3d origin_in_source() const { return -(rotation.transpose() * translation); }

  /// Homogeneous 4x4 matrix; last row (0, 0, 0, 1).
  LIBOCC_API Eigen::Matrix4d matrix() const;

  /// Converts a 4x4 matrix. Throws std::invalid_argument, with `name`, if it is not finite, its
  /// last row is not (0, 0, 0, 1), or its rotation is not orthonormal to 1e-6 with determinant +1.
  LIBOCC_API static Rigid3 from_matrix(const Eigen::Matrix4d& matrix,
                                       const char* name = "cam_from_world");
};

/// Applies the left perturbation defined above.
LIBOCC_API Rigid3 perturb(const Rigid3& transform, const Vector6& delta);

/// The delta with perturb(from, delta) == to.
LIBOCC_API Vector6 difference(const Rigid3& to, const Rigid3& from);

/// d (left perturbation of a * b) / d (left perturbation of b). The derivative by that of a is the
/// identity.
LIBOCC_API Matrix6 adjoint(const Rigid3& a);

/// 3x3 covariance of the camera's *position* in the world, from the 6x6 covariance of
/// cam_from_world: C = -R^T t moves by -R^T delta_trans, hence R^T S_tt R.
LIBOCC_API Eigen::Matrix3d position_covariance(const Rigid3& cam_from_world,
                                               const Matrix6& covariance);

/// Second moment of the nonlinear part of a rotation: exp(w) arm - arm - w x arm for a Gaussian w
/// of zero mean and covariance `rotation_covariance` [rad^2], `arm` [m] from the pivot. Added to
/// the covariance of the translation, it covers the curvature that a linear covariance neglects.
/// This matters if the rotation about a distant pivot is poorly known.
LIBOCC_API Eigen::Matrix3d arc_moment(const Eigen::Matrix3d& rotation_covariance,
                                      const Eigen::Vector3d& arm);

/// cam_from_world of a camera at `position` that looks at `target`. The image's up direction is as
/// close as possible to `up`. Throws std::invalid_argument if target == position or the view is
/// along `up`.
LIBOCC_API Rigid3 look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
                          const Eigen::Vector3d& up);

/// Heading of a camera: azimuth of the camera's +x axis (image right) about the world's Z axis, in
/// (-pi, pi]. Defined for any direction of view, except when +x is vertical.
LIBOCC_API double heading_rad(const Rigid3& cam_from_world);

}  // namespace occ
