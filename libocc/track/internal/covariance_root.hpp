// SPDX-License-Identifier: Apache-2.0
// Square-root form of a filter's covariance: P = R^T R, one column of R for each state.
//
// P is positive semi-definite for any R, also after rounding, and R has the square root of the
// condition number of P. The propagation P' = F P F^T + N^T N stacks R F^T on N and reduces the
// stack to an upper triangle by Householder reflections. Their rounding error in a column is
// relative to the standard deviation of that state, whatever the units and the length of the step.
//
// Source: Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, ch. V and VII.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "libocc/core/abi.hpp"

namespace occ::internal::track {

/// Householder reflection of the rows from i to count, which clears column i below row i. The rows
/// must be zero in the columns before i.
template <class Rows>
void clear_below(int i, int count, Rows& rows) {
  int end = count;
  while (end > i + 1 && rows(end - 1, i) == 0) --end;
  if (end <= i + 1) return;
  auto mirror = rows.col(i).segment(i, end - i);
  const double norm = mirror.norm(), first = mirror[0];
  // Squares of smaller values lose digits or underflow, and the reflection is not orthogonal.
  constexpr double min_norm = 1e-140;
  if (!(norm > min_norm)) return;
  const double scale = 1 / (norm * (norm + std::abs(first)));
  mirror[0] += first < 0 ? -norm : norm;
  for (int j = i + 1; j < rows.cols(); ++j) {
    auto column = rows.col(j).segment(i, end - i);
    column -= (scale * mirror.dot(column)) * mirror;
  }
  mirror.setZero();
  mirror[0] = first < 0 ? norm : -norm;
}

/// R of the prediction, on top of rows of noise.
template <int states, int max_noise>
class RootStack {
 public:
  using Root = Eigen::Matrix<double, states, states>;
  static constexpr int max_rows = states + max_noise;

  explicit RootStack(const Root& root) { rows_.template topRows<states>() = root; }

  /// Columns of successive states in all rows.
  template <int n>
  auto columns(int first) {
    return rows_.template middleCols<n>(first).topRows(count_);
  }

  /// Appends rows of zeros and returns them.
  template <int n>
  auto append() {
    count_ += n;
    auto added = rows_.template middleRows<n>(count_ - n);
    added.setZero();
    return added;
  }

  /// The first rows: F^T if the root was the identity.
  Root top() const { return rows_.template topRows<states>(); }

  /// R of the sum of all rows; upper triangular. Destroys the rows.
  Root root() {
    for (int i = 0; i < states; ++i) clear_below(i, count_, rows_);
    return rows_.template topRows<states>().template triangularView<Eigen::Upper>();
  }

 private:
  Eigen::Matrix<double, max_rows, states> rows_;
  int count_ = states;
};

/// Covariance of successive states. The variances are increased by 1e-13 of themselves, more than
/// the rounding errors of the product, so that the result is positive definite for users, too.
template <int n, class Root>
Eigen::Matrix<double, n, n> covariance_of(const Root& root, int first) {
  constexpr double rounding = 1e-13;
  const auto columns = root.template middleCols<n>(first);
  Eigen::Matrix<double, n, n> covariance;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j)
      covariance(i, j) = covariance(j, i) = columns.col(i).dot(columns.col(j));
    covariance(i, i) = columns.col(i).squaredNorm() * (1 + rounding);
  }
  return covariance;
}

}  // namespace occ::internal::track
