// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "libocc/core/internal/dense.hpp"
#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// x = L^-T x.
void divide_by_transposed(const SmallMatrix& lower, Eigen::Ref<VectorXd> x) {
  for (Index c = lower.rows(); c-- > 0;) {
    for (Index r = c + 1; r < lower.rows(); ++r) x[c] -= lower(r, c) * x[r];
    x[c] /= lower(c, c);
  }
}

}  // namespace

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

MatrixXd rows_in(const Batch& batch, const MatrixXd& over_reduced) {
  if (batch.rows.empty()) return over_reduced;
  MatrixXd rows(static_cast<Index>(batch.rows.size()), over_reduced.cols());
  for (std::size_t k = 0; k < batch.rows.size(); ++k)
    rows.row(static_cast<Index>(k)) = over_reduced.row(batch.rows[k]);
  return rows;
}

VectorXd back_substitute(const NetworkLayout& layout, const NormalEquations& normal,
                         const VectorXd& reduced_step) {
  VectorXd step(layout.total);
  step.head(layout.reduced) = reduced_step;
  for (std::size_t b = 0; b < layout.batches.size(); ++b) {
    const Batch& batch = layout.batches[b];
    const EliminatedBatch& part = normal.batches[b];
    VectorXd x = part.y;
    if (layout.reduced > 0) x.noalias() -= part.w.transpose() * rows_in(batch, reduced_step).col(0);
    Index column = 0;
    for (std::size_t g = batch.first; g < batch.last; ++g) {
      const Group& group = layout.groups[g];
      auto own = x.segment(column, group.size);
      divide_by_transposed(part.factors[g - batch.first], own);
      step.segment(group.offset, group.size) = own;
      column += group.size;
    }
  }
  return step;
}

double decrement_squared(const NormalEquations& normal, const VectorXd& reduced_step) {
  double sum = normal.rhs.dot(reduced_step);
  for (const EliminatedBatch& batch : normal.batches) sum += batch.y.squaredNorm();
  return sum;
}

}  // namespace occ::internal::network
