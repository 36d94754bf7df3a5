// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/pose_observation.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

bool finite(const Rigid3& pose) {
  return pose.rotation.allFinite() && pose.translation.allFinite();
}

}  // namespace

PoseObservation PoseObservation::of_pose(double time_s, const Rigid3& cam_from_world,
                                         const Matrix6& covariance, const Rigid3& cam_from_body) {
  const Eigen::LLT<Matrix6> llt(covariance);
  require(covariance.allFinite() && llt.info() == Eigen::Success, "covariance", covariance,
          "positive definite");
  PoseObservation seen;
  seen.time_s = time_s;
  seen.cam_from_world = cam_from_world;
  seen.information = llt.solve(Matrix6::Identity());
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
  require(information.allFinite(), "information", information, "finite");
  require(gradient.allFinite(), "gradient", gradient.transpose(), "finite");
}

}  // namespace occ
