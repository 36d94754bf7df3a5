// SPDX-License-Identifier: Apache-2.0
// What one image says of a camera's pose, to second order about a pose: half of its chi2 is
//
//   gradient . delta + 1/2 delta . information delta,   delta: left perturbation of cam_from_world
//
// One lamp or two leave the information singular, and still say something to whoever has a prior.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

struct LIBOCC_API PoseObservation {
  double time_s = 0;
  Rigid3 cam_from_world;
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  Rigid3 cam_from_body;  ///< how the camera is mounted; constant

  /// A pose with its covariance. Throws std::invalid_argument when that is not positive definite.
  static PoseObservation of_pose(double time_s, const Rigid3& cam_from_world,
                                 const Matrix6& covariance, const Rigid3& cam_from_body = {});

  /// The same of body_from_world: information and gradient are by its left perturbation.
  PoseObservation of_body() const;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

}  // namespace occ
