// SPDX-License-Identifier: Apache-2.0
// Kalman update in square-root form, with a measurement of the first states.
//
// A measurement is a set of rows w with residuals r: r + w . d has unit variance, where d is the
// error of the first states. Rows are processed one after the other. Givens rotations of
//     [1    0  ]             [sqrt(a)  k^T]
//     [R w  R  ]   result in [0        R+ ],   a = 1 + |R w|^2,
// from the last measured state to the first, so that no square of R and no difference of
// covariances is formed. The state changes by -k r / sqrt(a).
//
// Source: Bierman 1977, ch. II (data equation) and V (Carlson's triangular update); NIS:
// Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001,
// sec. 5.4.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/track/filter_update.hpp"
#include "libocc/track/internal/covariance_root.hpp"

namespace occ::internal::track {

/// Measurement as rows of unit variance: residuals + rows * (error of the states) + systematic *
/// (systematic errors).
template <int measured>
struct DataEquation {
  Eigen::Matrix<double, Eigen::Dynamic, measured, 0, measured, measured> rows;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, measured, 1> residuals;
  /// No columns without systematic errors.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, measured> systematic = {};
};

/// Data equation with rows^T rows = information, rows^T residuals = gradient and rows^T systematic
/// = gradient_by_systematic. Directions whose information is within the rounding errors of the
/// scaled matrix are left out, with their gradient.
LIBOCC_API DataEquation<6> data_equation(
    const Matrix6& information, const Vector6& gradient,
    const Eigen::Matrix<double, 6, Eigen::Dynamic>& gradient_by_systematic = {});

/// Derivatives of a data equation by three of the states.
using RowsOfThree = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 6, 3>;

/// Data equation of three states, with the derivatives `along`, after the elimination of the other
/// three, of unit variance, that the measurement depends on by `across`. Rows within the rounding
/// errors are left out.
LIBOCC_API DataEquation<3> eliminated(const RowsOfThree& across, const RowsOfThree& along,
                                      const DataEquation<6>& seen);

template <int states, int measured>
class RootUpdate {
 public:
  using Root = Eigen::Matrix<double, states, states>;
  using State = Eigen::Matrix<double, states, 1>;

  /// The first columns of the root must be zero below its first rows.
  RootUpdate(const Root& root, const DataEquation<measured>& seen)
      : rows_(root.template topRows<measured>()) {
    for (Eigen::Index i = 0; i < seen.rows.rows(); ++i)
      add(seen.rows.row(i).transpose(), seen.residuals[i]);
  }

  double nis() const { return nis_; }
  int dof() const { return dof_; }
  const State& step() const { return step_; }

  /// The first rows of R+; the other ones do not change.
  const auto& rows() const { return rows_; }

 private:
  using Row = Eigen::Matrix<double, measured, 1>;

  void add(const Row& row, double residual) {
    const Row across = rows_.template leftCols<measured>() * row;
    const double gain = across.squaredNorm();
    if (!(gain > 0)) return;
    const double innovation = residual + row.dot(step_.template head<measured>());
    Eigen::Matrix<double, 1, states> carried = Eigen::Matrix<double, 1, states>::Zero();
    double length = 1;  // sqrt(a) of the rows that are processed
    for (int j = measured - 1; j >= 0; --j) {
      const double longer = std::hypot(length, across[j]);
      const double c = length / longer, s = across[j] / longer;
      const Eigen::Matrix<double, 1, states> old = rows_.row(j);
      rows_.row(j) = c * old - s * carried;
      carried = c * carried + s * old;
      length = longer;
    }
    step_ -= carried.transpose() * (innovation / length);
    if (!(gain > min_gain)) return;
    ++dof_;
    nis_ += (innovation / length) * (innovation / length);
  }

  // A row with less than 1e-6 of the information of the prediction does not count for the NIS.
  static constexpr double min_gain = 1e-6;

  Eigen::Matrix<double, measured, states, Eigen::RowMajor> rows_;
  State step_ = State::Zero();
  double nis_ = 0;
  int dof_ = 0;
};

/// Outcome of a RootUpdate or a SystematicUpdate at the gate of a filter.
template <class Corrected>
FilterUpdate gated(const Corrected& corrected, double gate_sigma) {
  FilterUpdate update{FilterOutcome::accepted, corrected.nis(), corrected.dof()};
  if (update.nis_dof > 0 && update.nis > gate_chi2(gate_sigma, update.nis_dof))
    update.outcome = FilterOutcome::gated;
  return update;
}

}  // namespace occ::internal::track
