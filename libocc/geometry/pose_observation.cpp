// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/pose_observation.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

bool finite(const Rigid3& pose) {
  return pose.rotation.allFinite() && pose.translation.allFinite();
}

}  // namespace

PoseObservation PoseObservation::of_pose(double time_s, const Rigid3& cam_from_world,
                                         const Matrix6& covariance, const Rigid3& cam_from_body) {
  internal::core::require_positive_definite(covariance, "covariance");
  const Eigen::LLT<Matrix6> llt(0.5 * (covariance + covariance.transpose()));
  const Matrix6 root = llt.matrixL().solve(Matrix6::Identity());
  PoseObservation seen;
  seen.time_s = time_s;
  seen.cam_from_world = cam_from_world;
  seen.information = root.transpose() * root;
  seen.cam_from_body = cam_from_body;
  seen.validate();
  return seen;
}

PoseObservation PoseObservation::of_body() const {
  const Matrix6 cam_from_body_delta = adjoint(cam_from_body);
  PoseObservation body;
  body.time_s = time_s;
  body.cam_from_world = cam_from_body.inverse() * cam_from_world;
  body.information = cam_from_body_delta.transpose() * information * cam_from_body_delta;
  body.gradient = cam_from_body_delta.transpose() * gradient;
  return body;
}

void PoseObservation::validate() const {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  require(finite(cam_from_world), "cam_from_world", cam_from_world.matrix(), "finite");
  require(finite(cam_from_body), "cam_from_body", cam_from_body.matrix(), "finite");
  internal::core::require_semidefinite(information, "information");
  require(gradient.allFinite(), "gradient", gradient.transpose(), "finite");
}

}  // namespace occ
