// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/minimise.hpp"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace occ::internal::refine {
namespace {

/// Length of the residuals where a lamp cannot be seen: never accepted, and its square is finite.
constexpr double refused = 1e100;

/// How well a lamp's image is usually placed: turns pixels into the solver's units, sigmas.
constexpr double typical_sigma_px = 0.01;

/// The normal equations at the last step from a base state.
class Steps {
 public:
  Steps(RefineProblem& problem, const State& base) : problem_(problem) { rebase(base); }

  bool defined() const { return defined_; }
  const State& state() const { return state_; }
  const Eigen::Vector3d& pivot() const { return pivot_; }
  const Normal& normal() const { return normal_; }

  void rebase(const State& base) {
    base_ = base;
    base_pivot_ = problem_.pivot(base);
    linearise(Vector8::Zero());
  }
  State state_at(const Vector8& step) const { return moved(base_, base_pivot_, step); }
  double chi2_at(const Vector8& step) const { return problem_.chi2(state_at(step)); }

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
  Normal normal_;
  bool defined_ = false;
};

/// The problem as TinySolver takes it. Instead of hundreds of residuals it gets nine with the same
/// J^T J, J^T r and r^T r: the square root D^1/2 L^T P of the normal equations.
struct SquareRoot {
  using Scalar = double;
  enum { NUM_RESIDUALS = 9, NUM_PARAMETERS = 8 };
  using Residuals = Eigen::Matrix<double, NUM_RESIDUALS, 1>;
  using Jacobian = Eigen::Matrix<double, NUM_RESIDUALS, NUM_PARAMETERS>;

  Steps* steps;

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Vector8 step = Eigen::Map<const Vector8>(parameters);
    Eigen::Map<Residuals> r(residuals);
    r.setZero();
    if (!jacobian) {
      const double chi2 = steps->chi2_at(step);
      r[8] = chi2 < refused ? std::sqrt(std::max(0.0, chi2)) : refused;
      return true;
    }
    steps->linearise_at(step);
    if (!steps->defined()) return false;
    Matrix8 information = steps->normal().information;
    Vector8 gradient = steps->normal().gradient;
    const Eigen::Matrix3d turn = so3_left_jacobian(step.head<3>());
    information.leftCols<3>() = information.leftCols<3>() * turn;
    information.topRows<3>() = turn.transpose() * information.topRows<3>();
    gradient.head<3>() = turn.transpose() * gradient.head<3>();
    factor(information, gradient, steps->normal().chi2, r, Eigen::Map<Jacobian>(jacobian));
    return true;
  }

  static void factor(const Matrix8& information, const Vector8& gradient, double chi2,
                     Eigen::Map<Residuals> r, Eigen::Map<Jacobian> j) {
    const Eigen::LDLT<Matrix8> ldlt(information);
    const Vector8 d = ldlt.vectorD();
    const double least = 1e-15 * d.cwiseAbs().maxCoeff();
    const Matrix8 upper = ldlt.matrixU();
    const Vector8 permuted = ldlt.transpositionsP() * gradient;
    const Vector8 solved = ldlt.matrixL().solve(permuted);
    j.setZero();
    for (int i = 0; i < 8; ++i) {
      if (!(d[i] > least)) continue;
      j.row(i) = std::sqrt(d[i]) * upper.row(i);
      r[i] = solved[i] / std::sqrt(d[i]);
    }
    const Matrix8 lower = j.topRows<8>().transpose();
    j.topRows<8>() = (ldlt.transpositionsP().transpose() * lower).transpose();
    r[8] = std::sqrt(std::max(0.0, chi2 - r.head<8>().squaredNorm()));
  }
};

Vector8 gauss_newton_step(const Normal& normal) {
  const Vector8 scale = normal.information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Matrix8 scaled = scale.asDiagonal() * normal.information * scale.asDiagonal();
  const Vector8 solved = Eigen::LDLT<Matrix8>(scaled).solve(scale.cwiseProduct(normal.gradient));
  return -scale.cwiseProduct(solved);
}

/// Runs until the gradient is far below its noise or costs change by less than rounding shows.
int levenberg_marquardt(Steps& steps, int max_iterations, double tolerance_px) {
  ceres::TinySolver<SquareRoot> solver;
  solver.options.max_num_iterations = max_iterations + 1;  // it counts the evaluation at the start
  solver.options.gradient_tolerance = tolerance_px / typical_sigma_px;
  solver.options.function_tolerance = 1e-9;
  solver.options.parameter_tolerance = 0;
  solver.options.cost_threshold = 0;
  // Starts are close: plain Gauss-Newton until a step fails, also along weak directions.
  solver.options.initial_trust_region_radius = 1e8;
  Vector8 step = Vector8::Zero();
  solver.Solve(SquareRoot{&steps}, &step);
  steps.linearise_at(step);
  return std::min(solver.summary.iterations, max_iterations);
}

/// Plain Gauss-Newton steps until one moves no lamp further than the tolerance.
void gauss_newton(RefineProblem& problem, Steps& steps, int max_iterations, double tolerance_px,
                  Minimum& minimum) {
  while (steps.defined()) {
    minimum.pivot = steps.pivot();
    minimum.normal = steps.normal();
    minimum.state = steps.state();
    const Vector8 step = gauss_newton_step(steps.normal());
    if (!step.allFinite()) break;
    const State next = moved(steps.state(), steps.pivot(), step);
    minimum.converged =
        problem.largest_motion_px(steps.state(), steps.pivot(), step) <= tolerance_px;
    if (minimum.converged) minimum.state = next;
    if (minimum.converged || minimum.iterations >= max_iterations) break;
    ++minimum.iterations;
    steps.rebase(next);
  }
}

}  // namespace

Minimum minimise(RefineProblem& problem, const State& start, int max_iterations,
                 double tolerance_px) {
  Steps steps(problem, start);
  Minimum minimum{start, steps.pivot(), steps.normal(), 0, steps.defined(), false};
  if (!minimum.defined) return minimum;
  minimum.iterations = levenberg_marquardt(steps, max_iterations, tolerance_px);
  // What is left is below the resolution of the cost.
  gauss_newton(problem, steps, max_iterations, tolerance_px, minimum);
  return minimum;
}

Minimum polish(RefineProblem& problem, const State& start, int max_iterations,
               double tolerance_px) {
  Steps steps(problem, start);
  Minimum minimum{start, steps.pivot(), steps.normal(), 0, steps.defined(), false};
  if (minimum.defined) gauss_newton(problem, steps, max_iterations, tolerance_px, minimum);
  return minimum;
}

}  // namespace occ::internal::refine
