// SPDX-License-Identifier: Apache-2.0
// Nonlinear least squares: minimises |r(x)|^2 / 2 by the Levenberg-Marquardt method.
//
// minimise_sums() serves problems with a few unknowns. The solver is ceres::TinySolver (trust
// region of Madsen, Nielsen, Tingleff, "Methods for non-linear least squares problems", 2004,
// section 3.2). A problem supplies the sums H = J^T J, g = J^T r and r^T r. TinySolver takes
// residuals, so it receives n + 1 of them with the same sums: with the Cholesky factorisation H =
// U^T U,
//
//     J' = [U; 0],   r' = [U^-T g; sqrt(r^T r - |U^-T g|^2)]
//
// Hundreds of residuals are thereby summed once and copied nowhere. Directions with an eigenvalue
// of zero get no step. Robust losses are supplied as weighted sums, with twice the loss in r^T r.
//
// LevenbergMarquardt is the damping rule of solvers that factorise H by blocks themselves.
#pragma once

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/abi.hpp"

namespace occ::internal::core {

/// Sums over residuals with n unknowns (n may be Eigen::Dynamic).
template <int n>
struct NormalSums {
  using Matrix = Eigen::Matrix<double, n, n>;
  using Vector = Eigen::Matrix<double, n, 1>;
  Matrix information;  ///< J^T J
  Vector gradient;     ///< J^T r
  double chi2 = 0;     ///< r^T r

  void set_zero(Eigen::Index unknowns) {
    information.setZero(unknowns, unknowns);
    gradient.setZero(unknowns);
    chi2 = 0;
  }
};

struct LeastSquaresOptions {
  int max_iterations = 50;
  /// Converged when the Gauss-Newton step sqrt(g^T H^-1 g), in standard deviations of unit weight,
  /// is shorter, or when it lowers r^T r by less than rounding. 0: not tested.
  double step_tolerance = 0;
  /// Take that last step as well. Near the minimum r^T r does not resolve steps any more, but the
  /// gradient does: with 1e-5 as tolerance, the error that remains is far smaller.
  bool take_last_step = false;
  /// Converged when no element of g, scaled by 1 + |column of J|, is larger.
  double gradient_tolerance = std::numeric_limits<double>::min();
  double chi2_tolerance = 0;  ///< converged when r^T r changes by less
  double trust_radius = 1e4;  ///< at the start, in units of the scaled unknowns
};

struct LeastSquaresResult {
  int iterations = 0;
  bool converged = false;
};

/// Residuals and Jacobian, n + 1 rows, with the sums given; returns g^T H^-1 g.
template <int n, class Residuals, class Jacobian>
double square_root(const NormalSums<n>& sums, Residuals& r, Jacobian& j) {
  using Matrix = typename NormalSums<n>::Matrix;
  using Vector = typename NormalSums<n>::Vector;
  const Eigen::Index size = sums.gradient.size();
  const Eigen::LDLT<Matrix> ldlt(sums.information);
  const Vector d = ldlt.vectorD();
  const double singular = 1e-15 * d.cwiseAbs().maxCoeff();  // rounding of the factorisation
  const Matrix upper = ldlt.matrixU();
  const Vector permuted = ldlt.transpositionsP() * sums.gradient;
  const Vector solved = ldlt.matrixL().solve(permuted);
  r.setZero();
  j.setZero();
  for (Eigen::Index i = 0; i < size; ++i) {
    if (!(d[i] > singular)) continue;
    j.row(i) = std::sqrt(d[i]) * upper.row(i);
    r[i] = solved[i] / std::sqrt(d[i]);
  }
  const Matrix lower = j.template topRows<n>(size).transpose();
  j.template topRows<n>(size) = (ldlt.transpositionsP().transpose() * lower).transpose();
  const double step2 = r.template head<n>(size).squaredNorm();
  r[size] = std::sqrt(std::max(0.0, sums.chi2 - step2));
  return step2;
}

/// -H^-1 g; undetermined directions get no step.
template <int n>
typename NormalSums<n>::Vector gauss_newton_step(const NormalSums<n>& sums) {
  const Eigen::LDLT<typename NormalSums<n>::Matrix> ldlt(sums.information);
  const typename NormalSums<n>::Vector d = ldlt.vectorD();
  const double singular = 1e-15 * d.cwiseAbs().maxCoeff();
  typename NormalSums<n>::Vector step = ldlt.transpositionsP() * sums.gradient;
  ldlt.matrixL().solveInPlace(step);
  for (Eigen::Index i = 0; i < d.size(); ++i) step[i] = d[i] > singular ? -step[i] / d[i] : 0;
  ldlt.matrixU().solveInPlace(step);
  return ldlt.transpositionsP().transpose() * step;
}

/// A problem as TinySolver calls it.
template <class Problem>
struct TinyFunction {
  static constexpr int n = Problem::unknowns;
  static constexpr int rows = n == Eigen::Dynamic ? Eigen::Dynamic : n + 1;
  using Scalar = double;
  enum { NUM_RESIDUALS = rows, NUM_PARAMETERS = n };
  using Vector = Eigen::Matrix<double, n, 1>;
  /// Length of the residuals where the problem is undefined: never accepted, its square is finite.
  static constexpr double undefined = 1e100;

  Problem& problem;
  Eigen::Index size;
  double step_tolerance;
  Vector& last_step;  // zero unless the step is shorter than its tolerance
  bool& failed;

  int NumParameters() const { return static_cast<int>(size); }
  int NumResiduals() const { return static_cast<int>(size) + 1; }

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    constexpr double rounding = 1e-14;  // of r^T r: a step that lowers it by less is lost in it
    const Vector x = Eigen::Map<const Vector>(parameters, size);
    Eigen::Map<Eigen::Matrix<double, rows, 1>> r(residuals, size + 1);
    if (!jacobian) {
      const double chi2 = problem.chi2(x);
      r.setZero();
      r[size] = chi2 < undefined ? std::sqrt(std::max(0.0, chi2)) : undefined;
      return true;
    }
    Eigen::Map<Eigen::Matrix<double, rows, n>> j(jacobian, size + 1, size);
    NormalSums<n> sums;
    if (!problem.sums(x, sums)) {  // a gradient of zero ends the iteration
      failed = true;
      r.setZero();
      j.setZero();
      return true;
    }
    const double step2 = square_root<n>(sums, r, j);
    if (step_tolerance > 0 &&
        step2 <= std::max(step_tolerance * step_tolerance, rounding * sums.chi2)) {
      last_step = gauss_newton_step<n>(sums);
      r.template head<n>(size).setZero();  // a gradient of zero ends the iteration
    }
    return true;
  }
};

/// Minimises from `x` on. Problem:
///     static constexpr int unknowns;                            // or Eigen::Dynamic
///     double chi2(const Vector& x);                             // infinite where undefined
///     bool sums(const Vector& x, NormalSums<unknowns>& sums);   // false where undefined
/// The derivatives are with respect to x. x must be defined at the start, else `converged` is
/// false.
template <class Problem>
LeastSquaresResult minimise_sums(Problem& problem, Eigen::Matrix<double, Problem::unknowns, 1>& x,
                                 const LeastSquaresOptions& options) {
  using Function = TinyFunction<Problem>;
  bool failed = false;
  typename Function::Vector last_step = Function::Vector::Zero(x.size());
  ceres::TinySolver<Function> solver;
  solver.options.max_num_iterations = options.max_iterations + 1;  // counts the start as well
  solver.options.gradient_tolerance = options.gradient_tolerance;
  solver.options.function_tolerance = options.chi2_tolerance;
  solver.options.parameter_tolerance = 0;
  solver.options.cost_threshold = 0;
  solver.options.initial_trust_region_radius = options.trust_radius;
  solver.Solve(Function{problem, x.size(), options.step_tolerance, last_step, failed}, &x);
  const bool by_gradient = solver.summary.status == decltype(solver)::GRADIENT_TOO_SMALL;
  if (options.take_last_step && by_gradient && !failed) x += last_step;
  return {std::min(solver.summary.iterations, options.max_iterations),
          !failed && solver.summary.status != decltype(solver)::HIT_MAX_ITERATIONS};
}

/// Damping factor lambda of the steps (H + lambda diag H) d = -g. A step that fails is repeated
/// with ten times the damping. The default rule takes plain Gauss-Newton steps (lambda = 0) until
/// one fails; lambda is then 1e-3, and successes lower it to 0 again.
class LevenbergMarquardt {
 public:
  LevenbergMarquardt() = default;
  /// Rule for a singular H, which needs min > 0: each success divides lambda by `decrease`.
  LevenbergMarquardt(double first, double min, double decrease)
      : lambda_(first), min_(min), decrease_(decrease) {}

  double lambda() const { return lambda_; }

  /// lambda after a step that lowered the cost.
  double lambda_after_success() const {
    if (decrease_ > 0) return std::max(min_, lambda_ / decrease_);
    constexpr double negligible = 1e-10;  // less damping changes no step noticeably
    const double lower = lambda_ > 1e-4 ? lambda_ / 10 : lambda_ / 1000;
    return lower < negligible ? 0 : lower;
  }
  void accept() { lambda_ = lambda_after_success(); }

  /// False when the damping is so large that no step can lower the cost.
  bool reject() {
    constexpr double first = 1e-3, max = 1e12;
    lambda_ = lambda_ > 0 ? 10 * lambda_ : first;
    return lambda_ <= max;
  }

 private:
  double lambda_ = 0, min_ = 0, decrease_ = 0;
};

}  // namespace occ::internal::core
