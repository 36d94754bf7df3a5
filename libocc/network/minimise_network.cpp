// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/minimise_network.hpp"

#include <cmath>
#include <utility>

#include "libocc/network/internal/datum_directions.hpp"

namespace occ::internal::network {

namespace {

/// Damping: none while steps succeed; after a failure it starts here, and ends far above what any
/// step could need.
constexpr double first_damping = 1e-3, max_damping = 1e12, min_damping = 1e-10;

double damped_more(double damping) { return damping > 0 ? 10 * damping : first_damping; }
double damped_less(double damping) {
  const double less = damping > 1e-4 ? damping / 10 : damping / 1000;
  return less < min_damping ? 0 : less;
}

}  // namespace

Eigen::MatrixXd reduced_gauge(const Network& network, const NetworkLayout& layout,
                              const NetworkState& state) {
  return open_directions(network, layout, state, defect_at(network, state)).topRows(layout.reduced);
}

Minimised minimise(const Network& network, const NetworkLayout& layout, NetworkState& state,
                   const MinimiseOptions& options,
                   const std::function<bool(int iteration, double cost)>& report,
                   const std::function<void(NetworkState&)>& repair) {
  Minimised result;
  NormalEquations normal, next_normal;
  double damping = 0;
  std::vector<Index> ever_undetermined;
  const auto failed = [&](Ending ending) {
    result.ending = ending;
    if (result.undetermined.empty()) result.undetermined = ever_undetermined;
    return result;
  };
  build(network, layout, state, options.loss, damping, options.threads, normal);
  if (normal.lost > 0 && repair) {
    repair(state);
    build(network, layout, state, options.loss, damping, options.threads, normal);
  }
  result.cost = normal.cost;
  for (;;) {
    result.lost = normal.lost;
    if (!report(result.iterations, result.cost)) {
      result.ending = Ending::stopped;
      return result;
    }
    const ReducedSystem system(normal, reduced_gauge(network, layout, state));
    if (damping == 0) {
      result.undetermined = system.undetermined();
      result.loose_groups = normal.loose_groups;
      if (!system.determined()) ever_undetermined = system.undetermined();
    }
    bool accepted = false;
    if (system.solvable()) {
      const Eigen::VectorXd reduced_step = system.solve(normal.rhs);
      const double squared = decrement_squared(normal, reduced_step);
      result.step_sigma = std::sqrt(std::max(0.0, squared));
      const Eigen::VectorXd step = back_substitute(layout, normal, reduced_step);
      std::optional<NetworkState> next;
      if (step.allFinite() && std::isfinite(squared)) next = moved(layout, state, step);
      if (next && result.step_sigma < options.tolerance_sigma && damping == 0) {
        state = std::move(*next);  // too small to show in the cost, yet a better estimate
        result.ending = Ending::converged;
        return result;
      }
      if (result.iterations >= options.max_iterations) {
        return failed(Ending::iterations);
      }
      if (next) {
        const double next_damping = damped_less(damping);
        build(network, layout, *next, options.loss, next_damping, options.threads, next_normal);
        const double slack = 1e-13 * result.cost + 1e-20;
        accepted = next_normal.cost <= result.cost + slack && next_normal.lost <= normal.lost;
        if (accepted) {
          const double fall = result.cost - next_normal.cost;
          const double before = result.cost;
          state = std::move(*next);
          std::swap(normal, next_normal);
          result.cost = normal.cost;
          damping = next_damping;
          ++result.iterations;
          if (!ever_undetermined.empty() && fall < 1e-10 * before) return failed(Ending::stuck);
          if (options.min_fall > 0 && fall < options.min_fall * before) return result;
        }
      }
    }
    if (accepted) continue;
    // No lower cost to be had this close to the minimum: rounding decides.
    if (system.solvable() && damping == 0 &&
        result.step_sigma < 1e-3 * std::sqrt(result.cost + 1e-6) &&
        result.step_sigma < 1e3 * options.tolerance_sigma) {
      result.ending = Ending::converged;
      return result;
    }
    damping = damped_more(damping);
    if (damping > max_damping) {
      return failed(Ending::stuck);
    }
    build(network, layout, state, options.loss, damping, options.threads, normal);
  }
}

}  // namespace occ::internal::network
