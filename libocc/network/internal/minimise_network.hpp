// SPDX-License-Identifier: Apache-2.0
// Levenberg and Marquardt's steps of a network, and what is asked of its normal equations.
#pragma once

#include <functional>
#include <string>

#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

struct MinimiseOptions {
  Loss loss;
  int max_iterations = 100;
  double tolerance_sigma = 1e-6;
  double min_fall = 0;  ///< relative fall of the cost below which it is enough
  int threads = 2;
};

enum class Ending { converged, iterations, stuck, stopped };

struct Minimised {
  Ending ending = Ending::converged;
  int iterations = 0;
  double cost = 0;
  int lost = 0;                           ///< observations not in view
  double step_sigma = 0;                  ///< the last step, all unknowns together
  std::vector<std::size_t> loose_groups;  ///< whose own block is singular at the end
  /// Reduced unknowns that no observation determined when there was no damping last; without
  /// convergence, whenever there was none.
  std::vector<Index> undetermined;
};

/// `report` returns false to stop. `repair`, when given, is asked once to better a start from which
/// some camera does not show its targets.
Minimised minimise(const Network& network, const NetworkLayout& layout, NetworkState& state,
                   const MinimiseOptions& options,
                   const std::function<bool(int iteration, double cost)>& report,
                   const std::function<void(NetworkState&)>& repair = {});

/// The open directions of the reduced unknowns.
Eigen::MatrixXd reduced_gauge(const Network& network, const NetworkLayout& layout,
                              const NetworkState& state);

}  // namespace occ::internal::network
