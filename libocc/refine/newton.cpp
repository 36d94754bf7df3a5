// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/newton.hpp"

#include <cmath>
#include <optional>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::refine {
namespace {

bool linearise(RefineProblem& problem, const State& state, Minimum& minimum) {
  minimum.state = state;
  minimum.pivot = problem.pivot(state);
  return problem.linearise(state, minimum.pivot, minimum.normal);
}

/// Half the Hessian of chi2 in these units, from central differences of the gradient.
std::optional<Matrix8> half_hessian(RefineProblem& problem, const Minimum& minimum,
                                    const Vector8& units) {
  constexpr double step = 0.01;
  Matrix8 hessian;
  for (int k = 0; k < 8; ++k) {
    Vector8 ends[2];
    for (int side = 0; side < 2; ++side) {
      const Vector8 by = (side == 0 ? step : -step) * units[k] * Vector8::Unit(k);
      Minimum there = minimum;
      if (!linearise(problem, moved(minimum.state, minimum.pivot, by), there)) return std::nullopt;
      ends[side] = units.cwiseProduct(there.normal.gradient);
    }
    hessian.col(k) = (ends[0] - ends[1]) / (2 * step);
  }
  return 0.5 * (hessian + hessian.transpose());
}

/// Halves the step until chi2 falls. Returns false if it does not.
bool descend(RefineProblem& problem, Vector8 step, Minimum& minimum) {
  constexpr int max_halvings = 12;
  constexpr double rounding = 1e-12;
  const double limit = minimum.normal.robust_chi2 * (1 + rounding) + rounding;
  for (int i = 0; i < max_halvings; ++i, step *= 0.5) {
    Minimum there = minimum;
    if (!linearise(problem, moved(minimum.state, minimum.pivot, step), there) ||
        !(there.normal.robust_chi2 <= limit))
      continue;
    minimum = there;
    return true;
  }
  return false;
}

}  // namespace

void run_newton(RefineProblem& problem, int max_iterations, double tolerance_px, Minimum& minimum) {
  // A direction of less curvature is not determined; its step is limited.
  constexpr double min_curvature = 1e-9;
  constexpr double max_step = 1e3;  // in units of a single unknown's sigma
  minimum.converged = false;
  for (int i = 0; i < max_iterations; ++i, ++minimum.iterations) {
    const Vector8 units = units_of(minimum.normal);
    const std::optional<Matrix8> hessian = half_hessian(problem, minimum, units);
    if (!hessian) return;
    const auto eigen = core::symmetric_eigen<Matrix8>(*hessian);
    const Vector8 curvature = eigen.eigenvalues().cwiseAbs().cwiseMax(min_curvature);
    const Vector8 gradient = units.cwiseProduct(minimum.normal.gradient);
    Vector8 step = -eigen.eigenvectors() *
                   (eigen.eigenvectors().transpose() * gradient).cwiseQuotient(curvature);
    if (step.norm() > max_step) step *= max_step / step.norm();
    const Vector8 by = units.cwiseProduct(step);
    const bool small = problem.max_motion_px(minimum.state, minimum.pivot, by) <= tolerance_px;
    if (small && eigen.eigenvalues()[0] > min_curvature) {
      minimum.converged = true;
      minimum.normal.information =
          units.cwiseInverse().asDiagonal() * *hessian * units.cwiseInverse().asDiagonal();
      return;
    }
    if (!descend(problem, by, minimum)) return;
  }
}

}  // namespace occ::internal::refine
