// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/minimise_network.hpp"

#include <cmath>
#include <utility>

#include "libocc/core/internal/least_squares.hpp"
#include "libocc/network/internal/datum_directions.hpp"

namespace occ::internal::network {

Eigen::MatrixXd reduced_gauge(const Network& network, const NetworkLayout& layout,
                              const NetworkState& state) {
  return datum_null_space(network, layout, state, defect_at(network, state))
      .topRows(layout.reduced);
}

Minimised minimise(const Network& network, const NetworkLayout& layout, NetworkState& state,
                   const MinimiseOptions& options,
                   const std::function<bool(int iteration, double cost)>& report,
                   const std::function<void(NetworkState&)>& repair) {
  Minimised result;
  NormalEquations normal, next_normal;
  core::LevenbergMarquardt damping;
  std::vector<Index> ever_undetermined;
  const auto failed = [&](Ending ending) {
    result.ending = ending;
    if (result.undetermined.empty()) result.undetermined = ever_undetermined;
    return result;
  };
  build(network, layout, state, options.loss, damping.lambda(), options.threads, normal);
  if (normal.out_of_view > 0 && repair) {
    repair(state);
    build(network, layout, state, options.loss, damping.lambda(), options.threads, normal);
  }
  result.cost = normal.cost;
  for (;;) {
    result.out_of_view = normal.out_of_view;
    if (!report(result.iterations, result.cost)) {
      result.ending = Ending::stopped;
      return result;
    }
    const ReducedSystem system(normal, reduced_gauge(network, layout, state));
    if (damping.lambda() == 0) {
      result.undetermined = system.undetermined();
      result.singular_groups = normal.singular_groups;
      if (!system.determined()) ever_undetermined = system.undetermined();
    }
    bool accepted = false;
    if (system.solvable()) {
      const Eigen::VectorXd reduced_step = system.solve(normal.rhs);
      const double squared = decrement_squared(normal, reduced_step);
      result.step_sigma = std::sqrt(std::max(0.0, squared));
      const Eigen::VectorXd step = back_substitute(layout, normal, reduced_step);
      std::optional<NetworkState> next;
      if (step.allFinite() && std::isfinite(squared)) next = apply_step(layout, state, step);
      if (next && result.step_sigma < options.tolerance_sigma && damping.lambda() == 0) {
        state = std::move(*next);  // below the rounding of the cost, but a better estimate
        result.ending = Ending::converged;
        return result;
      }
      if (result.iterations >= options.max_iterations) {
        return failed(Ending::iterations);
      }
      if (next) {
        const double next_damping = damping.lambda_after_success();
        build(network, layout, *next, options.loss, next_damping, options.threads, next_normal);
        const double slack = 1e-13 * result.cost + 1e-20;
        accepted = next_normal.cost <= result.cost + slack &&
                   next_normal.out_of_view <= normal.out_of_view;
        if (accepted) {
          const double fall = result.cost - next_normal.cost;
          const double before = result.cost;
          state = std::move(*next);
          std::swap(normal, next_normal);
          result.cost = normal.cost;
          damping.accept();
          ++result.iterations;
          if (!ever_undetermined.empty() && fall < 1e-10 * before) return failed(Ending::stuck);
          if (options.min_fall > 0 && fall < options.min_fall * before) return result;
        }
      }
    }
    if (accepted) continue;
    // So close to the minimum, rounding errors exceed the decrease of the cost.
    if (system.solvable() && damping.lambda() == 0 &&
        result.step_sigma < 1e-3 * std::sqrt(result.cost + 1e-6) &&
        result.step_sigma < 1e3 * options.tolerance_sigma) {
      result.ending = Ending::converged;
      return result;
    }
    if (!damping.reject()) return failed(Ending::stuck);
    build(network, layout, state, options.loss, damping.lambda(), options.threads, normal);
  }
}

}  // namespace occ::internal::network
