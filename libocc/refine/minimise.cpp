// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/minimise.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"
#include "libocc/refine/internal/newton.hpp"

namespace occ::internal::refine {
namespace {

/// Typical standard deviation of a lamp's position: converts the tolerance from pixels to sigmas.
constexpr double typical_sigma_px = 0.01;

/// The normal equations at the last step from a base state.
class Steps {
 public:
  Steps(RefineProblem& problem, const State& base) : problem_(problem) { rebase(base); }

  bool defined() const { return defined_; }
  const State& state() const { return state_; }
  const Eigen::Vector3d& pivot() const { return pivot_; }
  const PoseNormalEquations& normal() const { return normal_; }

  void rebase(const State& base) {
    base_ = base;
    base_pivot_ = problem_.pivot(base);
    linearise(Vector8::Zero());
  }
  State state_at(const Vector8& step) const { return moved(base_, base_pivot_, step); }

  // The problem in the unknowns `step`, for core::minimise_sums().
  static constexpr int unknowns = 8;
  double chi2(const Vector8& step) { return problem_.chi2(state_at(step)); }
  bool sums(const Vector8& step, core::NormalSums<8>& sums) {
    linearise_at(step);
    if (!defined_) return false;
    sums.information = normal_.information;
    sums.gradient = normal_.gradient;
    const Eigen::Matrix3d turn = so3_left_jacobian(step.head<3>());
    sums.information.leftCols<3>() = sums.information.leftCols<3>() * turn;
    sums.information.topRows<3>() = turn.transpose() * sums.information.topRows<3>();
    sums.gradient.head<3>() = turn.transpose() * sums.gradient.head<3>();
    sums.chi2 = normal_.chi2;
    return true;
  }

  void linearise_at(const Vector8& step) {
    if (step != step_) linearise(step);
  }

 private:
  void linearise(const Vector8& step) {
    step_ = step;
    state_ = state_at(step);
    pivot_ = base_pivot_ + step.segment<3>(3);
    defined_ = problem_.linearise(state_, pivot_, normal_);
  }

  RefineProblem& problem_;
  State base_, state_;
  Eigen::Vector3d base_pivot_, pivot_;
  Vector8 step_;
  PoseNormalEquations normal_;
  bool defined_ = false;
};

Vector8 gauss_newton_step(const PoseNormalEquations& normal) {
  const Vector8 scale = normal.information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Matrix8 scaled = scale.asDiagonal() * normal.information * scale.asDiagonal();
  const Vector8 gradient = scale.cwiseProduct(normal.gradient);
  return -scale.cwiseProduct(core::solve_ldlt(scaled, gradient));
}

/// Runs until the gradient is far below its noise, or chi2 changes by less than rounding.
int levenberg_marquardt(Steps& steps, int max_iterations, double tolerance_px) {
  core::LeastSquaresOptions options;
  options.max_iterations = max_iterations;
  options.gradient_tolerance = tolerance_px / typical_sigma_px;
  options.chi2_tolerance = 1e-9;
  // Starts are close: plain Gauss-Newton until a step fails, also along weak directions.
  options.trust_radius = 1e8;
  Vector8 step = Vector8::Zero();
  const core::LeastSquaresResult result = core::minimise_sums(steps, step, options);
  steps.linearise_at(step);
  return result.iterations;
}

/// True if a step from a minimum of the linearised problem climbed. The robust chi2 is compared:
/// the weights change from step to step.
bool climbed(const PoseNormalEquations& from, const PoseNormalEquations& to) {
  constexpr double share = 0.01, rounding = 1e-6;
  return to.robust_chi2 > (1 + share) * from.robust_chi2 + rounding;
}

/// Gauss-Newton steps until one moves no lamp farther than the tolerance. With `downhill` it stops
/// before a step that climbs, which can lead to another minimum; returns true in that case.
bool gauss_newton(RefineProblem& problem, Steps& steps, int max_iterations, double tolerance_px,
                  bool downhill, Minimum& minimum) {
  for (bool first = true; steps.defined(); first = false) {
    if (downhill && !first && climbed(minimum.normal, steps.normal())) return true;
    minimum.pivot = steps.pivot();
    minimum.normal = steps.normal();
    minimum.state = steps.state();
    const Vector8 step = gauss_newton_step(steps.normal());
    if (!step.allFinite()) break;
    const State next = moved(steps.state(), steps.pivot(), step);
    minimum.converged = problem.max_motion_px(steps.state(), steps.pivot(), step) <= tolerance_px;
    if (minimum.converged) minimum.state = next;
    if (minimum.converged || minimum.iterations >= max_iterations) break;
    ++minimum.iterations;
    steps.rebase(next);
  }
  return false;
}

}  // namespace

Minimum minimise(RefineProblem& problem, const State& start, int max_iterations,
                 double tolerance_px) {
  Steps steps(problem, start);
  Minimum minimum{start, steps.pivot(), steps.normal(), 0, steps.defined(), false, Matrix6::Zero()};
  if (!minimum.defined) return minimum;
  minimum.iterations = levenberg_marquardt(steps, max_iterations, tolerance_px);
  // The remaining error is below the resolution of the cost.
  if (gauss_newton(problem, steps, max_iterations, tolerance_px, true, minimum))
    run_newton(problem, max_iterations, tolerance_px, minimum);
  minimum.shared_errors = problem.shared_estimate(Vector8::Zero());
  minimum.parts = problem.parts();
  return minimum;
}

Minimum polish(RefineProblem& problem, const State& start, int max_iterations,
               double tolerance_px) {
  Steps steps(problem, start);
  Minimum minimum{start, steps.pivot(), steps.normal(), 0, steps.defined(), false, Matrix6::Zero()};
  if (minimum.defined) gauss_newton(problem, steps, max_iterations, tolerance_px, false, minimum);
  minimum.parts = problem.parts();
  return minimum;
}

Minimum step_with_shared_errors(RefineProblem& problem, const State& start, double tolerance_px) {
  Steps steps(problem, start);
  Minimum minimum{start, steps.pivot(), steps.normal(), 1, steps.defined(), false, Matrix6::Zero()};
  if (!minimum.defined) return minimum;
  const Vector8 step = gauss_newton_step(steps.normal());
  minimum.defined = step.allFinite();
  if (!minimum.defined) return minimum;
  // A step of the pose that errors of the camera undo in the image is small compared with its
  // sigma, but not in pixels.
  const double sigmas = std::sqrt(step.dot(steps.normal().information * step));
  minimum.converged =
      sigmas <= stable_sigmas || problem.max_motion_px(start, steps.pivot(), step) <= tolerance_px;
  minimum.state = moved(start, steps.pivot(), step);
  minimum.shared_errors = problem.shared_estimate(step);
  minimum.parts = problem.parts();
  return minimum;
}

}  // namespace occ::internal::refine
