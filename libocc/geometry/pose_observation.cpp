// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/pose_observation.hpp"

#include <cmath>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/internal/independent_part.hpp"

namespace occ {
namespace {

bool finite(const Rigid3& pose) {
  return pose.rotation.allFinite() && pose.translation.allFinite();
}

}  // namespace

PoseObservation PoseObservation::of_pose(double time_s, const Rigid3& cam_from_world,
                                         const Matrix6& covariance, const Rigid3& cam_from_body) {
  internal::core::require_positive_definite(covariance, "covariance");
  const internal::core::Cholesky<Matrix6> cholesky(0.5 * (covariance + covariance.transpose()));
  const Matrix6 root = cholesky.solve_lower<Matrix6>(Matrix6::Identity());
  PoseObservation seen;
  seen.time_s = time_s;
  seen.cam_from_world = cam_from_world;
  seen.information = root.transpose() * root;
  seen.cam_from_body = cam_from_body;
  seen.validate();
  return seen;
}

PoseObservation PoseObservation::without_systematic() const {
  return internal::geometry::independent_part(*this).observation;
}

internal::geometry::IndependentPart internal::geometry::independent_part(
    const PoseObservation& seen) {
  IndependentPart part{seen, Eigen::MatrixXd::Zero(6, 0)};
  if (seen.systematic.empty()) return part;
  PoseObservation& out = part.observation;
  out.systematic.clear();
  out.gradient_by_systematic.resize(6, 0);
  out.uncertain_systematic = 0;
  constexpr double rounding = 1e-13;
  const Matrix6& information = seen.information;
  const Vector6 scale = information.diagonal().cwiseMax(0).cwiseSqrt();
  const Vector6 unit = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const auto eigen =
      internal::core::symmetric_eigen<Matrix6>(unit.asDiagonal() * information * unit.asDiagonal());
  const Vector6 values = eigen.eigenvalues();
  const auto known = values.array() > rounding * values.maxCoeff();
  const Vector6 root = known.select(values.cwiseMax(0).cwiseSqrt(), 0);
  const Vector6 inverse = known.select(root.cwiseInverse(), 0);
  // The whitened observation has the rows root V^T scale and the errors b = inverse V^T unit S. The
  // errors increase its covariance from 1 to 1 + b b^T.
  const Matrix6 rows = root.asDiagonal() * eigen.eigenvectors().transpose() * scale.asDiagonal();
  const Matrix6 whiten =
      inverse.asDiagonal() * eigen.eigenvectors().transpose() * unit.asDiagonal();
  const Eigen::MatrixXd by_errors = whiten * seen.gradient_by_systematic;
  Eigen::MatrixXd covariance = internal::core::product_transposed(by_errors, by_errors);
  covariance.diagonal().array() += 1;
  const Matrix6 weighted = internal::core::solve_llt(covariance, Eigen::MatrixXd(rows));
  out.information = rows.transpose() * weighted;
  out.information = (0.5 * (out.information + out.information.transpose())).eval();
  out.gradient = weighted.transpose() * (whiten * seen.gradient);
  part.by_systematic = weighted.transpose() * by_errors;
  return part;
}

PoseObservation PoseObservation::of_body() const {
  if (!systematic.empty()) return without_systematic().of_body();
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
  require(gradient_by_systematic.cols() == static_cast<Eigen::Index>(systematic.size()),
          "gradient_by_systematic.cols()", gradient_by_systematic.cols(),
          "the number of systematic errors");
  require(uncertain_systematic >= 0 && uncertain_systematic <= static_cast<int>(systematic.size()),
          "uncertain_systematic", uncertain_systematic,
          "between zero and the number of systematic errors");
  require(gradient_by_systematic.allFinite(), "gradient_by_systematic", gradient_by_systematic,
          "finite");
}

}  // namespace occ
