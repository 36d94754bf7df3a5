// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/pose_covariance.hpp"

#include <cmath>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::refine {
namespace {

constexpr double singular = 1e-12;

/// Smallest share of the largest eigenvalue that is no rounding error. A prior of the focal length
/// may be 1e-13 of what thousands of points of rims tell about the other directions.
constexpr double rounding = 1e-14;

/// Information about the centred perturbation.
Matrix6 marginal_information(const PoseNormalEquations& normal) {
  const Eigen::Matrix<double, 6, 2> mixed = normal.information.topRightCorner<6, 2>();
  const Eigen::Matrix2d nuisance = normal.information.bottomRightCorner<2, 2>();
  return normal.information.topLeftCorner<6, 6>() -
         mixed * core::solve_ldlt<Eigen::Matrix2d, Eigen::Matrix<double, 2, 6>>(nuisance,
                                                                                mixed.transpose());
}

/// Information about the left perturbation from that about the centred perturbation.
Matrix6 about_left(const Matrix6& centred, const Eigen::Vector3d& pivot) {
  Matrix6 centred_from_left = Matrix6::Identity();
  centred_from_left.bottomLeftCorner<3, 3>() = -skew(pivot);
  const Matrix6 information = centred_from_left.transpose() * centred * centred_from_left;
  return 0.5 * (information + information.transpose());
}

}  // namespace

Matrix6 pose_information(const PoseNormalEquations& normal, const Eigen::Vector3d& pivot) {
  return about_left(marginal_information(normal), pivot);
}

Matrix6 lamp_information(const PoseNormalEquations& normal, const PoseNormalEquations& prior,
                         const Eigen::Vector3d& pivot) {
  const Matrix6 all = marginal_information(normal);
  const core::Cholesky<Matrix6> root(all);
  if (!root.exists()) return Matrix6::Zero();
  const Matrix6 lamps = all - prior.information.topLeftCorner<6, 6>();
  const Matrix6 half = root.solve_lower(lamps).transpose();
  const auto eigen = core::symmetric_eigen(root.solve_lower(half));
  const Vector6 share = (eigen.eigenvalues().array() > singular).select(eigen.eigenvalues(), 0);
  const Matrix6 rows =
      share.cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose() * root.lower().transpose();
  return about_left(rows.transpose() * rows, pivot);
}

PoseCovariance pose_covariance(const PoseNormalEquations& normal, const Eigen::Vector3d& pivot) {
  PoseCovariance pose;
  const Matrix6 information = marginal_information(normal);
  const Vector6 diagonal = information.diagonal();
  const double turn = std::sqrt(diagonal.head<3>().maxCoeff());
  const double shift = std::sqrt(diagonal.tail<3>().maxCoeff());
  if (!(turn > 0) || !(shift > 0) || !information.allFinite()) return pose;
  Vector6 scale;
  scale << Eigen::Vector3d::Constant(1 / turn), Eigen::Vector3d::Constant(1 / shift);
  const auto eigen =
      core::symmetric_eigen<Matrix6>(scale.asDiagonal() * information * scale.asDiagonal());
  const Vector6 values = eigen.eigenvalues();
  pose.rank = static_cast<int>((values.array() > rounding * values.maxCoeff()).count());
  if (pose.rank < 6) return pose;
  Matrix6 left_from_centred = Matrix6::Identity();
  left_from_centred.bottomLeftCorner<3, 3>() = skew(pivot);
  const Matrix6 root = left_from_centred * scale.asDiagonal() * eigen.eigenvectors() *
                       values.cwiseSqrt().cwiseInverse().asDiagonal();
  pose.covariance = root * root.transpose();
  return pose;
}

}  // namespace occ::internal::refine
