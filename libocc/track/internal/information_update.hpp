// SPDX-License-Identifier: Apache-2.0
// Kalman update with a measurement of the first states in information form, which may be singular.
// Half the chi2 of the measurement at a state moved by d from the prediction is g . d + d . L d
// / 2. With the covariance P = S S^T of these states and the eigenvalues a of S^T L S = V diag(a)
// V^T:
//     P+ = S V diag(1 / (1 + a)) V^T S^T,    d = -S V diag(1 / (1 + a)) V^T S^T g,
//     NIS = sum (V^T S^T g)^2 / (a (1 + a)) over the measured directions.
// The other states are updated by their correlation. Covariances stay positive definite.
// Source: the matrix inversion lemma; NIS: Bar-Shalom, Li, Kirubarajan, Estimation with
// Applications to Tracking and Navigation, 2001, sec. 5.4.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"

namespace occ::internal::track {

template <int states, int measured>
class InformationUpdate {
 public:
  using Covariance = Eigen::Matrix<double, states, states>;
  using Information = Eigen::Matrix<double, measured, measured>;
  using Gradient = Eigen::Matrix<double, measured, 1>;

  InformationUpdate(const Covariance& covariance, const Information& information,
                    const Gradient& gradient)
      : covariance_(covariance) {
    const Eigen::LLT<Information> root(
        Information(covariance.template topLeftCorner<measured, measured>()));
    const Information s = root.matrixL();
    const auto eigen = core::symmetric_eigen<Information>(s.transpose() * information * s);
    gain_ = eigen.eigenvalues().cwiseMax(0);
    seen_ = eigen.eigenvectors().transpose() * (s.transpose() * gradient);
    // P(:, measured) S^-T V
    across_ = root.matrixL().solve(covariance.template topRows<measured>()).transpose().eval() *
              eigen.eigenvectors();
    const double min_gain = std::max(measurable, rounding * gain_.maxCoeff());
    for (int i = 0; i < measured; ++i) {
      if (!(gain_[i] > min_gain)) continue;
      ++dof_;
      nis_ += seen_[i] * seen_[i] / (gain_[i] * (1 + gain_[i]));
    }
  }

  int dof() const { return dof_; }
  double nis() const { return nis_; }

  Eigen::Matrix<double, states, 1> step() const {
    return -across_ * (seen_.array() / (1 + gain_.array())).matrix();
  }

  Covariance covariance() const {
    const Gradient less = (gain_.array() / (1 + gain_.array())).matrix();
    const Covariance updated = covariance_ - across_ * less.asDiagonal() * across_.transpose();
    return 0.5 * (updated + updated.transpose());
  }

 private:
  // Eigenvalues below 1e-6 of the information of the prediction (1 in these coordinates), or within
  // the rounding error of the largest one, are treated as zero.
  static constexpr double measurable = 1e-6, rounding = 1e-12;

  const Covariance& covariance_;
  Gradient gain_, seen_;
  Eigen::Matrix<double, states, measured> across_;
  double nis_ = 0;
  int dof_ = 0;
};

}  // namespace occ::internal::track
