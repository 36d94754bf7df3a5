// SPDX-License-Identifier: Apache-2.0
#include "libocc/photometry/internal/light_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"

namespace occ::internal::photometry {
namespace {

constexpr int max_light_steps = 50;
constexpr double min_order = 0.05, max_order = 200;

struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
  double chi2 = 0;
};

/// Place of each lamp's order among the unknowns (s is the first), -1 when it is held.
std::vector<int> places_of(const std::vector<bool>& fitted) {
  std::vector<int> places;
  int next = 1;
  for (const bool one : fitted) places.push_back(one ? next++ : -1);
  return places;
}

/// Normal equations at the parameters of `fit`, with Huber's weights there.
NormalEquations normal_at(const std::vector<FluxEquation>& equations, const LightFit& fit,
                          double huber) {
  const std::vector<int> places = places_of(fit.determined);
  const auto size = 1 + std::count(fit.determined.begin(), fit.determined.end(), true);
  NormalEquations sum{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
  for (const FluxEquation& e : equations) {
    const double left = fit.residual(e);
    const double weight = core::huber_weight(square(left / e.sigma), huber) / (e.sigma * e.sigma);
    const double by_order = 1 / (fit.orders[e.lamp] + 1) + e.log_cos;
    const int place = places[e.lamp];
    sum.matrix(0, 0) += weight;
    sum.right[0] += weight * left;
    sum.chi2 += weight * left * left;
    if (place < 0) continue;
    sum.matrix(place, 0) += weight * by_order;
    sum.matrix(0, place) += weight * by_order;
    sum.matrix(place, place) += weight * by_order * by_order;
    sum.right[place] += weight * left * by_order;
  }
  return sum;
}

/// The fit in the unknowns s and the orders that are fitted, as steps from a start.
struct LightProblem {
  static constexpr int unknowns = Eigen::Dynamic;
  const std::vector<FluxEquation>& equations;
  const LightFit start;
  const double huber;
  const std::vector<int> places = places_of(start.determined);

  LightFit at(const Eigen::VectorXd& step) const {
    LightFit fit = start;
    fit.scale += step[0];
    for (std::size_t lamp = 0; lamp < places.size(); ++lamp) {
      if (places[lamp] < 0) continue;
      double& order = fit.orders[static_cast<Eigen::Index>(lamp)];
      order = std::clamp(order + step[places[lamp]], min_order, max_order);
    }
    return fit;
  }

  double chi2(const Eigen::VectorXd& step) const {
    const LightFit fit = at(step);
    double loss = 0;
    for (const FluxEquation& e : equations)
      loss += core::huber_loss(square(fit.residual(e) / e.sigma), huber);
    return 2 * loss;
  }

  bool sums(const Eigen::VectorXd& step, core::NormalSums<Eigen::Dynamic>& sums) const {
    const NormalEquations normal = normal_at(equations, at(step), huber);
    sums = {normal.matrix, -normal.right, chi2(step)};
    return sums.information.allFinite() && sums.gradient.allFinite();
  }
};

/// False when the steps do not converge, or the equations leave a combination of the unknowns open.
bool descend(const std::vector<FluxEquation>& equations, double huber, LightFit& fit) {
  const LightProblem problem{equations, fit, huber};
  core::LeastSquaresOptions options;
  options.max_iterations = max_light_steps;
  options.step_tolerance = 1e-5;
  options.take_last_step = true;
  options.chi2_tolerance = 1e-12;  // at the limits of an order the gradient does not vanish
  const auto fitted = std::count(fit.determined.begin(), fit.determined.end(), true);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(1 + fitted);
  const bool converged = core::minimise_sums(problem, step, options).converged;
  fit = problem.at(step);
  return converged && core::is_positive_definite(normal_at(equations, fit, huber).matrix);
}

void state(const std::vector<FluxEquation>& equations, double huber, LightFit& fit) {
  const NormalEquations normal = normal_at(equations, fit, huber);
  const Eigen::Index size = normal.matrix.rows();
  fit.chi2 = normal.chi2;
  fit.dof = static_cast<int>(equations.size()) - static_cast<int>(size);
  fit.variance_factor = variance_factor(fit.chi2, fit.dof);
  const Eigen::MatrixXd known =
      fit.variance_factor * core::solve_llt<Eigen::MatrixXd, Eigen::MatrixXd>(
                                normal.matrix, Eigen::MatrixXd::Identity(size, size));
  std::vector<int> places = places_of(fit.determined);
  places.insert(places.begin(), 0);
  const auto all = static_cast<Eigen::Index>(places.size());
  fit.covariance = Eigen::MatrixXd::Zero(all, all);
  for (Eigen::Index i = 0; i < all; ++i)
    for (Eigen::Index j = 0; j < all; ++j) {
      const int a = places[i], b = places[j];
      if (a >= 0 && b >= 0) fit.covariance(i, j) = known(a, b);
      if (i == j && a < 0) fit.covariance(i, j) = std::numeric_limits<double>::infinity();
    }
}

/// The lamp among the fitted ones whose angles differ least.
int narrowest(const std::vector<FluxEquation>& equations, const std::vector<bool>& fitted) {
  int found = -1;
  double least = 0;
  for (int lamp = 0; lamp < static_cast<int>(fitted.size()); ++lamp) {
    if (!fitted[lamp]) continue;
    double low = 0, high = -std::numeric_limits<double>::infinity();
    for (const FluxEquation& e : equations) {
      if (e.lamp != lamp) continue;
      low = std::min(low, e.log_cos);
      high = std::max(high, e.log_cos);
    }
    if (found >= 0 && high - low >= least) continue;
    found = lamp;
    least = high - low;
  }
  return found;
}

/// The lamp whose fitted order is to be held instead: one at the end of what orders can be, else
/// the least certain one when that is too uncertain; -1: none.
int undetermined(const LightFit& fit, double max_order_sigma) {
  int worst = -1;
  double largest = max_order_sigma;
  for (int lamp = 0; lamp < fit.orders.size(); ++lamp) {
    if (!fit.determined[lamp]) continue;
    const double order = fit.orders[lamp];
    if (!(order > min_order && order < max_order)) return lamp;
    const double sigma = std::sqrt(fit.covariance(lamp + 1, lamp + 1));
    if (sigma <= largest) continue;
    worst = lamp;
    largest = sigma;
  }
  return worst;
}

}  // namespace

double LightFit::residual(const FluxEquation& e) const {
  const double order = orders[e.lamp];
  return e.observed - scale - std::log(order + 1) - order * e.log_cos;
}

LightFit fit_light(const std::vector<FluxEquation>& equations, const Eigen::VectorXd& orders,
                   const std::vector<bool>& held_orders, const FitLimits& limits) {
  constexpr std::size_t fewest = 3;
  std::vector<std::size_t> counts(static_cast<std::size_t>(orders.size()));
  for (const FluxEquation& e : equations) ++counts[e.lamp];
  LightFit start;
  start.orders = orders;
  for (std::size_t i = 0; i < counts.size(); ++i)
    start.determined.push_back(counts[i] >= fewest && !held_orders[i]);
  for (;;) {
    LightFit fit = start;
    const bool converged = descend(equations, limits.huber_sigma, fit);
    if (converged) state(equations, limits.huber_sigma, fit);
    const int held = converged ? undetermined(fit, limits.max_order_sigma)
                               : narrowest(equations, fit.determined);
    if (held < 0) {
      if (!converged) state(equations, limits.huber_sigma, fit);  // Huber's steps may go to and fro
      return fit;
    }
    start.determined[held] = false;
  }
}

}  // namespace occ::internal::photometry
