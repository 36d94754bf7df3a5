// SPDX-License-Identifier: Apache-2.0
// Minimisation of a network's cost by Levenberg-Marquardt steps on the reduced normal equations.
#pragma once

#include <functional>
#include <string>

#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

struct MinimiseOptions {
  Loss loss;
  int max_iterations = 100;
  double tolerance_sigma = 1e-6;
  double min_fall = 0;  ///< stops when the relative decrease of the cost is less; 0: never
  int threads = 2;
};

enum class Ending { converged, iterations, stuck, stopped };

struct Minimised {
  Ending ending = Ending::converged;
  int iterations = 0;
  double cost = 0;
  int out_of_view = 0;                       ///< number of observations whose target is not in view
  double step_sigma = 0;                     ///< norm of the last step, in sigmas
  std::vector<std::size_t> singular_groups;  ///< groups with a singular diagonal block at the end
  /// Reduced unknowns that no observation determined in the last undamped step; without
  /// convergence, in any undamped step.
  std::vector<Index> undetermined;
};

/// Improves `state`. `report` is called before each step and returns false to stop. `repair` is
/// called once if some targets are out of view at the start; it may change the state.
Minimised minimise(const Network& network, const NetworkLayout& layout, NetworkState& state,
                   const MinimiseOptions& options,
                   const std::function<bool(int iteration, double cost)>& report,
                   const std::function<void(NetworkState&)>& repair = {});

/// Rows of datum_null_space() that belong to the reduced unknowns.
Eigen::MatrixXd reduced_gauge(const Network& network, const NetworkLayout& layout,
                              const NetworkState& state);

}  // namespace occ::internal::network
