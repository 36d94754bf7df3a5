// SPDX-License-Identifier: Apache-2.0
// Unknowns and normal equations of the refinement. The pose has a *centred* perturbation: a
// rotation about a pivot among the lamps (camera frame), then a translation. For distant lamps
// rotation and translation are then nearly uncorrelated, unlike for a rotation about the camera's
// centre.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::refine {

/// Order: rotation, translation, growth_px, log_factor.
using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
inline constexpr int growth_index = 6;
inline constexpr int log_factor_index = 7;

struct State {
  Rigid3 cam_from_world;
  double growth_px = 0;   ///< growth of the rims of saturated lamps
  double log_factor = 0;  ///< ln(seen flux / predicted flux), common to all lamps
};

/// J^T J, J^T r and r^T r of whitened, weighted residuals.
struct PoseNormalEquations {
  Matrix8 information = Matrix8::Zero();
  Vector8 gradient = Vector8::Zero();
  double chi2 = 0;
  double robust_chi2 = 0;  ///< sum of twice Huber's loss
  int pixels = 0;          ///< direct rung: number of pixels minus the lamps' own unknowns

  void add(const Vector8& row, double residual) {
    information.noalias() += row * row.transpose();
    gradient += residual * row;
    chi2 += residual * residual;
    robust_chi2 += residual * residual;
  }
};

/// The part of the normal equations that belongs to the errors that lamps share (SharedErrors),
/// whose prior is a unit variance each.
struct SharedSums {
  Eigen::Matrix<double, 8, Eigen::Dynamic> mixed;  ///< J^T J of the unknowns and the errors
  Eigen::MatrixXd information;                     ///< J^T J of the errors, with their prior
  Eigen::VectorXd gradient;                        ///< J^T r of the errors, with their prior

  explicit SharedSums(Eigen::Index errors)
      : mixed(Eigen::Matrix<double, 8, Eigen::Dynamic>::Zero(8, errors)),
        information(Eigen::MatrixXd::Identity(errors, errors)),
        gradient(Eigen::VectorXd::Zero(errors)) {}

  /// Inverse of `information`.
  Eigen::MatrixXd gain() const {
    return core::solve_llt(
        information, Eigen::MatrixXd(Eigen::MatrixXd::Identity(gradient.size(), gradient.size())));
  }
};

/// Unknowns in units of the standard deviation that each would have alone.
inline Vector8 units_of(const PoseNormalEquations& normal) {
  return normal.information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
}

/// The state after a finite step whose pose part is centred at the pivot.
inline State moved(const State& state, const Eigen::Vector3d& pivot, const Vector8& step) {
  const Eigen::Matrix3d turn = so3_exp(step.head<3>());
  const Rigid3& pose = state.cam_from_world;
  return {{turn * pose.rotation, turn * (pose.translation - pivot) + pivot + step.segment<3>(3)},
          state.growth_px + step[growth_index],
          state.log_factor + step[log_factor_index]};
}

/// Row of d residual / d left perturbation -> d residual / d centred perturbation.
inline void centre_row(Vector8& row, const Eigen::Vector3d& pivot) {
  row.head<3>() += row.segment<3>(3).cross(pivot);
}

}  // namespace occ::internal::refine
