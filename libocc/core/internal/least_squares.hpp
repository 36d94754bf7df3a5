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

#include <Eigen/Core>
#include <algorithm>
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

/// A problem of minimise(). The derivatives are with respect to x.
template <int n>
class SumsProblem {
 public:
  using Vector = typename NormalSums<n>::Vector;
  virtual ~SumsProblem() = default;
  virtual double chi2(const Vector& x) = 0;                     ///< infinite where undefined
  virtual bool sums(const Vector& x, NormalSums<n>& sums) = 0;  ///< false where undefined
};

/// Minimises from `x` on. x must be defined at the start, else `converged` is false.
/// least_squares.cpp instantiates it for the numbers of unknowns that are in use, because the
/// solver takes seconds to compile.
template <int n>
LeastSquaresResult minimise(SumsProblem<n>& problem, typename SumsProblem<n>::Vector& x,
                            const LeastSquaresOptions& options);

/// minimise() for a class that has the functions of SumsProblem and its number of unknowns:
///     static constexpr int unknowns;                            // or Eigen::Dynamic
template <class Problem>
LeastSquaresResult minimise_sums(Problem& problem, Eigen::Matrix<double, Problem::unknowns, 1>& x,
                                 const LeastSquaresOptions& options) {
  constexpr int n = Problem::unknowns;
  using Vector = typename SumsProblem<n>::Vector;
  class Adapter final : public SumsProblem<n> {
   public:
    explicit Adapter(Problem& problem) : problem_(problem) {}
    double chi2(const Vector& x) override { return problem_.chi2(x); }
    bool sums(const Vector& x, NormalSums<n>& sums) override { return problem_.sums(x, sums); }

   private:
    Problem& problem_;
  };
  Adapter adapter(problem);
  return minimise<n>(adapter, x, options);
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
