// SPDX-License-Identifier: Apache-2.0
// The normal equations of a network and their reduced system. With N = [U E; E^T V], V block
// diagonal with one block L L^T for each eliminated point or body, and W = E L^-T:
//
//     S = U - W W^T,  rhs = g_c - W y,  y = L^-1 g_p;   S dc = rhs,  dp = L^-T (y - W^T dc)
//
// (Brown 1958; Triggs et al., "Bundle adjustment: a modern synthesis", 1999, section 6.1). W is
// kept for each batch, and its product is one product of dense matrices. Work is divided into
// partial sums, as many as the network's size suggests, which are added in a fixed order: the same
// bits for any number of threads. What no observation determines (the datum, columns `gauge` of the
// reduced unknowns) is held by adding to S, scaled to a unit diagonal, the projector onto it: its
// step is then zero.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_group, max_group>;

struct EliminatedBatch {
  Eigen::MatrixXd w;                 ///< rows of the batch x its columns
  std::vector<SmallMatrix> factors;  ///< L of each group
  Eigen::VectorXd y;
};

struct NormalEquations {
  double cost = 0;          ///< sum of rho
  int lost = 0;             ///< observations whose target is not shown
  Eigen::MatrixXd reduced;  ///< S, lower triangle
  Eigen::VectorXd rhs;
  Eigen::VectorXd diagonal;  ///< of U, undamped
  std::vector<EliminatedBatch> batches;
  std::vector<std::size_t> loose_groups;  ///< whose own block is singular
};

/// Marquardt's damping: every diagonal element of N times 1 + damping.
void build(const Network& network, const NetworkLayout& layout, const NetworkState& state,
           const Loss& loss, double damping, int threads, NormalEquations& normal);

/// The reduced system, scaled, with the datum held.
class ReducedSystem {
 public:
  ReducedSystem(const NormalEquations& normal, const Eigen::MatrixXd& gauge);

  bool solvable() const { return solvable_; }
  bool determined() const { return undetermined_.empty(); }
  /// Reduced unknowns of a direction that no observation determines, the foremost first.
  const std::vector<Index>& undetermined() const { return undetermined_; }
  /// The same of the direction that is determined least.
  std::vector<Index> weakest() const;
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  /// Of the reduced unknowns, in the datum where they have the least trace when scaled.
  Eigen::MatrixXd covariance() const;

 private:
  bool solvable_ = true;
  Eigen::VectorXd scale_;  // 1 / sqrt of the diagonal
  Eigen::MatrixXd scaled_;
  Eigen::MatrixXd null_;  // orthonormal, of the scaled matrix
  Eigen::MatrixXd factor_;
  std::vector<Index> undetermined_;
};

/// Steps of all unknowns from those of the reduced ones.
Eigen::VectorXd back_substitute(const NetworkLayout& layout, const NormalEquations& normal,
                                const Eigen::VectorXd& reduced_step);

/// g^T N^-1 g: twice what a quadratic cost has still to fall.
double decrement_squared(const NormalEquations& normal, const Eigen::VectorXd& reduced_step);

/// Rows of a batch, of a vector or matrix over the reduced unknowns.
Eigen::MatrixXd rows_in(const Batch& batch, const Eigen::MatrixXd& over_reduced);

}  // namespace occ::internal::network
