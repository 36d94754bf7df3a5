// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/least_squares.hpp"

#include <ceres/tiny_solver.h>

#include <cmath>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::core {
namespace {

/// H = P^T L D L^T P and L^-1 P g of some sums.
template <int n>
class Factorised {
 public:
  using Matrix = typename NormalSums<n>::Matrix;
  using Vector = typename NormalSums<n>::Vector;

  explicit Factorised(const NormalSums<n>& sums)
      : sums_(sums),
        ldlt_(sums.information),
        d_(ldlt_.factors().vectorD()),
        solved_(ldlt_.factors().transpositionsP() * sums.gradient),
        singular_(1e-15 * d_.cwiseAbs().maxCoeff()) {
    ldlt_.factors().matrixL().solveInPlace(solved_);
  }

  /// Residuals and Jacobian, n + 1 rows, with the sums; returns g^T H^-1 g.
  template <class Residuals, class Jacobian>
  double square_root(Residuals& r, Jacobian& j) const {
    const Eigen::Index size = d_.size();
    const Matrix upper = ldlt_.factors().matrixU();
    r.setZero();
    j.setZero();
    for (Eigen::Index i = 0; i < size; ++i) {
      if (!(d_[i] > singular_)) continue;
      j.row(i) = std::sqrt(d_[i]) * upper.row(i);
      r[i] = solved_[i] / std::sqrt(d_[i]);
    }
    const Matrix lower = j.template topRows<n>(size).transpose();
    j.template topRows<n>(size) =
        (ldlt_.factors().transpositionsP().transpose() * lower).transpose();
    const double step2 = r.template head<n>(size).squaredNorm();
    r[size] = std::sqrt(std::max(0.0, sums_.chi2 - step2));
    return step2;
  }

  /// -H^-1 g; undetermined directions get no step.
  Vector gauss_newton_step() const {
    Vector step = Vector::Zero(d_.size());
    for (Eigen::Index i = 0; i < d_.size(); ++i)
      if (d_[i] > singular_) step[i] = -solved_[i] / d_[i];
    ldlt_.factors().matrixU().solveInPlace(step);
    return ldlt_.factors().transpositionsP().transpose() * step;
  }

 private:
  const NormalSums<n>& sums_;
  Ldlt<Matrix> ldlt_;
  Vector d_, solved_;
  double singular_;  // rounding of the factorisation
};

/// A problem as TinySolver calls it.
template <int n>
struct TinyFunction {
  static constexpr int rows = n == Eigen::Dynamic ? Eigen::Dynamic : n + 1;
  using Scalar = double;
  enum { NUM_RESIDUALS = rows, NUM_PARAMETERS = n };
  using Vector = Eigen::Matrix<double, n, 1>;
  /// Length of the residuals where the problem is undefined: never accepted, its square is finite.
  static constexpr double undefined = 1e100;

  SumsProblem<n>& problem;
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
    const Factorised<n> factorised(sums);
    const double step2 = factorised.square_root(r, j);
    if (step_tolerance > 0 &&
        step2 <= std::max(step_tolerance * step_tolerance, rounding * sums.chi2)) {
      last_step = factorised.gauss_newton_step();
      r.template head<n>(size).setZero();  // a gradient of zero ends the iteration
    }
    return true;
  }
};

}  // namespace

template <int n>
LeastSquaresResult minimise(SumsProblem<n>& problem, typename SumsProblem<n>::Vector& x,
                            const LeastSquaresOptions& options) {
  using Function = TinyFunction<n>;
  bool failed = false;
  typename Function::Vector last_step = Function::Vector::Zero(x.size());
  ceres::TinySolver<Function, Ldlt<typename NormalSums<n>::Matrix>> solver;
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

template LeastSquaresResult minimise(SumsProblem<6>&, SumsProblem<6>::Vector&,
                                     const LeastSquaresOptions&);
template LeastSquaresResult minimise(SumsProblem<8>&, SumsProblem<8>::Vector&,
                                     const LeastSquaresOptions&);
template LeastSquaresResult minimise(SumsProblem<Eigen::Dynamic>&, Eigen::VectorXd&,
                                     const LeastSquaresOptions&);

}  // namespace occ::internal::core
