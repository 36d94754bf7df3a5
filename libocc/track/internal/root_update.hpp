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

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"
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
template <int measured>
DataEquation<measured> data_equation(
    const Eigen::Matrix<double, measured, measured>& information,
    const Eigen::Matrix<double, measured, 1>& gradient,
    const Eigen::Matrix<double, measured, Eigen::Dynamic>& gradient_by_systematic = {}) {
  using Square = Eigen::Matrix<double, measured, measured>;
  using Column = Eigen::Matrix<double, measured, 1>;
  constexpr double clearly_regular = 1e-3, rounding = 1e-13;
  const Column scale = information.diagonal().cwiseMax(0).cwiseSqrt();
  const Column unit = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const Square scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const Column slope = unit.cwiseProduct(gradient);
  const Eigen::LLT<Square> cholesky(scaled);
  if (cholesky.info() == Eigen::Success &&
      cholesky.matrixLLT().diagonal().minCoeff() > clearly_regular) {
    DataEquation<measured> out{cholesky.matrixU() * Square(scale.asDiagonal()),
                               cholesky.matrixL().solve(slope)};
    if (gradient_by_systematic.cols() > 0)
      out.systematic = cholesky.matrixL().solve(unit.asDiagonal() * gradient_by_systematic);
    return out;
  }
  const auto eigen = core::symmetric_eigen<Square>(scaled);
  const double largest = eigen.eigenvalues()[measured - 1];  // in ascending order
  const auto rank = (eigen.eigenvalues().array() > rounding * largest).count();
  const auto values = eigen.eigenvalues().tail(rank).cwiseSqrt();
  const auto directions = eigen.eigenvectors().rightCols(rank).transpose();
  DataEquation<measured> out{values.asDiagonal() * directions * scale.asDiagonal(),
                             values.cwiseInverse().asDiagonal() * (directions * slope)};
  if (gradient_by_systematic.cols() > 0)
    out.systematic = values.cwiseInverse().asDiagonal() *
                     (directions * (unit.asDiagonal() * gradient_by_systematic));
  return out;
}

/// Reduces rows [identity 0 0; across along right]: the first `kept` columns are eliminated.
template <int kept, class Across, class Along, class Right, class Rows>
DataEquation<kept> eliminated_in(Rows& rows, const Across& across, const Along& along,
                                 const Right& right) {
  constexpr double rounding = 1e-13;
  const int measured = static_cast<int>(right.rows()), count = kept + measured;
  rows.setZero();
  rows.template topLeftCorner<kept, kept>().setIdentity();
  rows.middleRows(kept, measured) << across, along, right;
  const double smallest = rounding * along.norm();
  for (int i = 0; i < 2 * kept; ++i) clear_below(i, count, rows);
  const int left = std::min(measured, kept);
  const auto errors = static_cast<int>(rows.cols()) - 2 * kept - 1;
  DataEquation<kept> out{rows.template block<kept, kept>(kept, kept).topRows(left),
                         rows.col(2 * kept).segment(kept, left)};
  if (errors > 0) out.systematic = rows.block(kept, 2 * kept + 1, left, errors);
  for (int i = 0; i < left; ++i) {
    if (out.rows.row(i).norm() > smallest) continue;
    out.rows.row(i).setZero();
    if (errors > 0) out.systematic.row(i).setZero();
  }
  return out;
}

/// Data equation of `kept` states after the elimination of as many others, of unit variance, that
/// the measurement depends on by `across`. Rows within the rounding errors are left out.
template <int kept, class Across, class Along>
DataEquation<kept> eliminated(const Across& across, const Along& along,
                              const DataEquation<6>& seen) {
  constexpr int max_rows = kept + 6, columns = 2 * kept + 1;
  const Eigen::Index errors = seen.systematic.cols();
  if (errors == 0) {
    Eigen::Matrix<double, max_rows, columns> rows;
    return eliminated_in<kept>(rows, across, along, seen.residuals);
  }
  Eigen::Matrix<double, max_rows, Eigen::Dynamic> rows(max_rows, columns + errors);
  Eigen::MatrixXd right(seen.residuals.size(), 1 + errors);
  right << seen.residuals, seen.systematic;
  return eliminated_in<kept>(rows, across, along, right);
}

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

}  // namespace occ::internal::track
