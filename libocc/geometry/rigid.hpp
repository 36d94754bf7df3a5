// SPDX-License-Identifier: Apache-2.0
// A rigid transform whose name says what it does: `cam_from_world` takes a point in the world to
// the camera's frame, and chains as `d_from_b = d_from_c * c_from_b`.
//
// Covariance of a transform (6x6): order [rotation, translation], *left* perturbation
//     T(delta) : R -> exp(delta_rot) R,  t -> exp(delta_rot) t + delta_trans,
// so that a transformed point moves by delta_rot x (R p + t) + delta_trans.
// World: right-handed, metres, Z up. Camera: x right, y down, z forward.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"

namespace occ {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Rigid3 {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  Rigid3 operator*(const Rigid3& b_from_a) const {
    return {rotation * b_from_a.rotation, rotation * b_from_a.translation + translation};
  }
  Rigid3 inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
  /// For `cam_from_world`: where the camera's centre is in the world.
  Eigen::Vector3d origin_in_source() const { return -(rotation.transpose() * translation); }

  LIBOCC_API Eigen::Matrix4d matrix() const;

  /// From a 4x4 matrix. Throws std::invalid_argument when it is not finite, its last row is not
  /// (0, 0, 0, 1), or its rotation is not orthonormal to 1e-6 with determinant +1.
  LIBOCC_API static Rigid3 from_matrix(const Eigen::Matrix4d& matrix,
                                       const char* name = "cam_from_world");
};

/// The left perturbation defined above.
LIBOCC_API Rigid3 perturb(const Rigid3& transform, const Vector6& delta);

/// The delta with perturb(from, delta) == to.
LIBOCC_API Vector6 difference(const Rigid3& to, const Rigid3& from);

/// d (left perturbation of a * b) / d (left perturbation of b). That of a is the identity.
LIBOCC_API Matrix6 adjoint(const Rigid3& a);

/// 3x3 covariance of the camera's *position* in the world, from the 6x6 covariance of
/// cam_from_world: C = -R^T t moves by -R^T delta_trans, hence R^T S_tt R.
LIBOCC_API Eigen::Matrix3d position_covariance(const Rigid3& cam_from_world,
                                               const Matrix6& covariance);

/// Turned by w of covariance `turn`, a point at `arm` from the pivot moves by w x arm and on an
/// arc: the second moment of how far the arc leads from that tangent. Added to the covariance of
/// the translation, it covers what a covariance cannot follow where the turn about something far
/// away is hardly known.
LIBOCC_API Eigen::Matrix3d arc_moment(const Eigen::Matrix3d& turn, const Eigen::Vector3d& arm);

/// Camera that stands at `position` and looks at `target`; the image's up direction is as near to
/// `up` as it can be. Throws std::invalid_argument when target == position or the view is along
/// `up`.
LIBOCC_API Rigid3 look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
                          const Eigen::Vector3d& up);

/// Heading of a camera: azimuth about the world's Z of the camera's +x axis (image right), in (-pi,
/// pi]. Defined for cameras that look up, down or ahead alike, except when +x is vertical.
LIBOCC_API double heading_rad(const Rigid3& cam_from_world);

}  // namespace occ
