// SPDX-License-Identifier: Apache-2.0
// State of a Precision: the factors of the normal equations, the covariance Q of the reduced
// unknowns in the datum where their scaled covariance has the least trace, and the S-transformation
// to the requested datum
//
//     Q' = Q - H K^T - K H^T + H M H^T,   K = Q B,  H = G (B^T G)^-1,  M = B^T Q B.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "libocc/network/internal/datum_directions.hpp"
#include "libocc/network/internal/normal_equations.hpp"
#include "libocc/network/precision.hpp"

namespace occ::internal::network {

/// The part that does not depend on the datum.
struct FreePrecision {
  Network network;  ///< without observations
  NetworkLayout layout;
  NetworkState state;
  DatumDefect defect;
  Eigen::MatrixXd null_space;  ///< G: all unknowns x defect
  std::vector<EliminatedBatch> batches;
  Eigen::MatrixXd covariance;  ///< covariance of the reduced unknowns
  int threads = 1;

  struct GroupLocation {
    std::size_t batch = 0, within = 0;  ///< its batch, and its index in that batch
    Index column = 0;                   ///< its first column in the batch
  };
  std::vector<GroupLocation> locations;  ///< one per group

  explicit FreePrecision(const Network& from) : state(from) {}

  /// Q times columns (all unknowns x any).
  Eigen::MatrixXd times(const Eigen::MatrixXd& columns) const;
  /// Index of the group that contains an unknown.
  std::size_t group_at(Index offset) const;
  /// Derivative of some unknowns with respect to the reduced ones: size x reduced.
  Eigen::MatrixXd dependence(Index offset, Index size) const;
  /// Block of Q.
  Eigen::MatrixXd between(Index a, Index a_size, Index b, Index b_size) const;
};

struct PrecisionState {
  std::shared_ptr<const FreePrecision> free;
  double factor = 1;           ///< variance factor
  Eigen::MatrixXd h, qb, bqb;  ///< H, K = Q B, M = B^T Q B

  /// Block of factor * Q'.
  Eigen::MatrixXd between(Eigen::Index a, Eigen::Index a_size, Eigen::Index b,
                          Eigen::Index b_size) const;
};

}  // namespace occ::internal::network
