// SPDX-License-Identifier: Apache-2.0
// What a Precision holds: the factors of the normal equations, the covariance of the reduced
// unknowns in the datum where they have the least trace, and the S-transformation to the datum
// asked for,  Q' = Q - H K^T - K H^T + H M H^T  with K = Q B, H = G (B^T G)^-1, M = B^T Q B.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "libocc/network/internal/datum_directions.hpp"
#include "libocc/network/internal/normal_equations.hpp"
#include "libocc/network/precision.hpp"

namespace occ::internal::network {

/// What does not depend on the datum.
struct FreePrecision {
  Network network;  ///< without observations
  NetworkLayout layout;
  NetworkState state;
  DatumDefect defect;
  Eigen::MatrixXd open;  ///< G
  std::vector<EliminatedBatch> batches;
  Eigen::MatrixXd covariance;  ///< of the reduced unknowns
  int threads = 1;

  struct GroupPlace {
    std::size_t batch = 0, within = 0;
    Index column = 0;
  };
  std::vector<GroupPlace> places;  ///< of each group

  explicit FreePrecision(const Network& from) : state(from) {}

  /// Q times columns over all unknowns.
  Eigen::MatrixXd times(const Eigen::MatrixXd& columns) const;
  std::size_t group_at(Index offset) const;
  /// How some unknowns follow from the reduced ones: size x reduced.
  Eigen::MatrixXd dependence(Index offset, Index size) const;
  Eigen::MatrixXd between(Index a, Index a_size, Index b, Index b_size) const;
};

struct PrecisionState {
  std::shared_ptr<const FreePrecision> free;
  double factor = 1;
  Eigen::MatrixXd along, applied, middle;  ///< H, K, M

  Eigen::MatrixXd between(Eigen::Index a, Eigen::Index a_size, Eigen::Index b,
                          Eigen::Index b_size) const;
};

}  // namespace occ::internal::network
