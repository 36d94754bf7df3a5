// SPDX-License-Identifier: Apache-2.0
// The normal equations of a network and their reduced system. With N = [U E; E^T V], V block
// diagonal with one block L L^T for each eliminated point or body, and W = E L^-T:
//
//     S = U - W W^T,  rhs = g_c - W y,  y = L^-1 g_p;   S dc = rhs,  dp = L^-T (y - W^T dc)
//
// (Brown 1958; Triggs et al., "Bundle adjustment: a modern synthesis", 1999, section 6.1). W is
// kept for each batch, and W W^T is one product of dense matrices. Work is divided into partial
// sums, as many as the network's size suggests, which are added in a fixed order: the same bits for
// any number of threads.
//
// The datum is free: the columns of `gauge` (over the reduced unknowns) span the null space of S.
// The projector onto this space is added to S after scaling to a unit diagonal; the step is then
// zero along it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_group, max_group>;

struct EliminatedBatch {
  Eigen::MatrixXd w;                 ///< W: rows of the batch x its columns
  std::vector<SmallMatrix> factors;  ///< L of each group
  Eigen::VectorXd y;
};

struct NormalEquations {
  double cost = 0;          ///< sum of rho (Loss)
  int out_of_view = 0;      ///< number of observations whose target is not in view
  Eigen::MatrixXd reduced;  ///< S, lower triangle
  Eigen::VectorXd rhs;
  Eigen::VectorXd diagonal;  ///< diagonal of U without damping
  std::vector<EliminatedBatch> batches;
  std::vector<std::size_t> singular_groups;  ///< groups with a singular diagonal block
};

/// Builds the equations at `state`. Marquardt's damping multiplies each diagonal element of N by
/// 1 + damping.
void build(const Network& network, const NetworkLayout& layout, const NetworkState& state,
           const Loss& loss, double damping, int threads, NormalEquations& normal);

/// The reduced system S dc = rhs, scaled to a unit diagonal, with the datum fixed by `gauge`.
class ReducedSystem {
 public:
  ReducedSystem(const NormalEquations& normal, const Eigen::MatrixXd& gauge);

  bool solvable() const { return solvable_; }
  bool determined() const { return undetermined_.empty(); }
  /// Reduced unknowns with the largest components in an undetermined direction, largest first.
  const std::vector<Index>& undetermined() const { return undetermined_; }
  /// Reduced unknowns with the largest components in the direction of the least eigenvalue.
  std::vector<Index> weakest() const;
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  /// Covariance of the reduced unknowns, in the datum where the scaled covariance has the least
  /// trace.
  Eigen::MatrixXd covariance() const;

 private:
  bool solvable_ = true;
  Eigen::VectorXd scale_;  // 1 / sqrt of the diagonal
  Eigen::MatrixXd scaled_;
  Eigen::MatrixXd null_;  // orthonormal null space of the scaled matrix
  Eigen::MatrixXd factor_;
  std::vector<Index> undetermined_;
};

/// Step of all unknowns from the step of the reduced ones.
Eigen::VectorXd back_substitute(const NetworkLayout& layout, const NormalEquations& normal,
                                const Eigen::VectorXd& reduced_step);

/// g^T N^-1 g: twice the remaining decrease of a quadratic cost.
double decrement_squared(const NormalEquations& normal, const Eigen::VectorXd& reduced_step);

/// Rows of a vector or matrix over the reduced unknowns that belong to a batch.
Eigen::MatrixXd rows_in(const Batch& batch, const Eigen::MatrixXd& over_reduced);

}  // namespace occ::internal::network
