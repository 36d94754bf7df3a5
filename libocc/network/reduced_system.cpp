// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "libocc/core/internal/dense.hpp"
#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

using Eigen::MatrixXd;
using Eigen::VectorXd;

ReducedSystem::ReducedSystem(const NormalEquations& normal, const MatrixXd& gauge) {
  const Index n = normal.reduced.rows();
  if (n == 0) return;
  // A diagonal element that cancels completely is rounding error; the bound replaces it.
  const VectorXd diagonal =
      normal.reduced.diagonal().cwiseMax(1e-13 * normal.diagonal).cwiseMax(1e-300);
  scale_ = diagonal.cwiseSqrt().cwiseInverse();
  scaled_ = scale_.asDiagonal() * normal.reduced.selfadjointView<Eigen::Lower>().toDenseMatrix() *
            scale_.asDiagonal();
  if (gauge.cols() > 0) {
    const MatrixXd unscaled = scale_.cwiseInverse().asDiagonal() * gauge;
    null_ = core::householder_q(unscaled, gauge.cols());
    scaled_ += core::product_transposed(null_, null_);
  }
  const core::Cholesky<MatrixXd> cholesky(scaled_);
  solvable_ = cholesky.exists();
  if (solvable_) factor_ = cholesky.lower();
  const VectorXd noise = 1e-13 * normal.diagonal.cwiseQuotient(diagonal).cwiseMax(10);
  constexpr double singular = 1e-12;  // rounding gives 1e-13 where it should be zero
  bool regular = solvable_ && cholesky.rcond() > singular;
  for (Index k = 0; regular && k < n; ++k) regular = factor_(k, k) * factor_(k, k) > noise[k];
  if (!regular) undetermined_ = weakest();
}

std::vector<Index> ReducedSystem::weakest() const {
  constexpr Index max_size = 600;  // eigenvectors of larger matrices take too long
  const Index n = scaled_.rows();
  if (n == 0) return {};
  VectorXd direction = VectorXd::Zero(n);
  if (n <= max_size) {
    const auto eigen = core::symmetric_eigen<MatrixXd>(scaled_);
    direction = eigen.eigenvectors().col(0).cwiseAbs();
  } else {
    const core::Ldlt<MatrixXd> ldlt(scaled_);
    Index worst = 0;
    ldlt.factors().vectorD().minCoeff(&worst);
    const VectorXd order = VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1));
    const VectorXd permuted = ldlt.factors().transpositionsP() * order;
    direction[static_cast<Index>(permuted[worst])] = 1;
  }
  std::vector<Index> all(n), dominant;
  for (Index k = 0; k < n; ++k) all[k] = k;
  std::stable_sort(all.begin(), all.end(),
                   [&](Index a, Index b) { return direction[a] > direction[b]; });
  for (const Index k : all)
    if (direction[k] > 0.2 * direction[all[0]]) dominant.push_back(k);
  return dominant;
}

VectorXd ReducedSystem::solve(const VectorXd& rhs) const {
  if (rhs.size() == 0) return rhs;
  VectorXd x = scale_.cwiseProduct(rhs);
  const auto lower = factor_.triangularView<Eigen::Lower>();
  lower.solveInPlace(x);
  lower.transpose().solveInPlace(x);
  if (null_.cols() > 0) x -= null_ * (null_.transpose() * x);
  return scale_.cwiseProduct(x);
}

MatrixXd ReducedSystem::covariance() const {
  const Index n = scale_.size();
  if (n == 0) return {};
  MatrixXd inverse = MatrixXd::Identity(n, n);
  core::solve_lower_in_place(factor_, inverse);
  MatrixXd q = core::gram_matrix(inverse);
  if (null_.cols() > 0) core::subtract_square(null_, q);
  return scale_.asDiagonal() * q.selfadjointView<Eigen::Lower>().toDenseMatrix() *
         scale_.asDiagonal();
}

}  // namespace occ::internal::network
