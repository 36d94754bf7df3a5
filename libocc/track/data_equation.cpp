// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>

#include "libocc/core/internal/dense.hpp"
#include "libocc/track/internal/root_update.hpp"

namespace occ::internal::track {
namespace {

constexpr double rounding = 1e-13;

/// Reduces rows [identity 0 0; across along right]: the first three columns are eliminated.
template <class Right, class Rows>
DataEquation<3> eliminated_in(Rows& rows, const RowsOfThree& across, const RowsOfThree& along,
                              const Right& right) {
  const int measured = static_cast<int>(right.rows()), count = 3 + measured;
  rows.setZero();
  rows.template topLeftCorner<3, 3>().setIdentity();
  rows.middleRows(3, measured) << across, along, right;
  const double smallest = rounding * along.norm();
  for (int i = 0; i < 6; ++i) clear_below(i, count, rows);
  const int left = std::min(measured, 3);
  const auto errors = static_cast<int>(rows.cols()) - 7;
  DataEquation<3> out{rows.template block<3, 3>(3, 3).topRows(left), rows.col(6).segment(3, left)};
  if (errors > 0) out.systematic = rows.block(3, 7, left, errors);
  for (int i = 0; i < left; ++i) {
    if (out.rows.row(i).norm() > smallest) continue;
    out.rows.row(i).setZero();
    if (errors > 0) out.systematic.row(i).setZero();
  }
  return out;
}

}  // namespace

DataEquation<6> data_equation(
    const Matrix6& information, const Vector6& gradient,
    const Eigen::Matrix<double, 6, Eigen::Dynamic>& gradient_by_systematic) {
  constexpr double clearly_regular = 1e-3;
  const Vector6 scale = information.diagonal().cwiseMax(0).cwiseSqrt();
  const Vector6 unit = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const Matrix6 scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const Vector6 slope = unit.cwiseProduct(gradient);
  const Eigen::LLT<Matrix6> cholesky(scaled);
  if (cholesky.info() == Eigen::Success &&
      cholesky.matrixLLT().diagonal().minCoeff() > clearly_regular) {
    DataEquation<6> out{cholesky.matrixU() * Matrix6(scale.asDiagonal()),
                        cholesky.matrixL().solve(slope)};
    if (gradient_by_systematic.cols() > 0)
      out.systematic = cholesky.matrixL().solve(unit.asDiagonal() * gradient_by_systematic);
    return out;
  }
  const auto eigen = core::symmetric_eigen<Matrix6>(scaled);
  const double largest = eigen.eigenvalues()[5];  // in ascending order
  const auto rank = (eigen.eigenvalues().array() > rounding * largest).count();
  const auto values = eigen.eigenvalues().tail(rank).cwiseSqrt();
  const auto directions = eigen.eigenvectors().rightCols(rank).transpose();
  DataEquation<6> out{values.asDiagonal() * directions * scale.asDiagonal(),
                      values.cwiseInverse().asDiagonal() * (directions * slope)};
  if (gradient_by_systematic.cols() > 0)
    out.systematic = values.cwiseInverse().asDiagonal() *
                     (directions * (unit.asDiagonal() * gradient_by_systematic));
  return out;
}

DataEquation<3> eliminated(const RowsOfThree& across, const RowsOfThree& along,
                           const DataEquation<6>& seen) {
  constexpr int max_rows = 9, columns = 7;
  const Eigen::Index errors = seen.systematic.cols();
  if (errors == 0) {
    Eigen::Matrix<double, max_rows, columns> rows;
    return eliminated_in(rows, across, along, seen.residuals);
  }
  Eigen::MatrixXd rows(max_rows, columns + errors);
  Eigen::MatrixXd right(seen.residuals.size(), 1 + errors);
  right << seen.residuals, seen.systematic;
  return eliminated_in(rows, across, along, right);
}

}  // namespace occ::internal::track
