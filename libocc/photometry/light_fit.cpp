// SPDX-License-Identifier: Apache-2.0
#include "libocc/photometry/internal/light_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/statistics.hpp"

namespace occ::internal::photometry {
namespace {

constexpr int max_steps = 50;
constexpr double min_order = 0.05, max_order = 200;  // beyond any lamp

struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd rhs;
  double chi2 = 0;
};

/// Index of each lamp's order among the unknowns (s is the first); -1: held.
std::vector<int> columns_of_orders(const std::vector<bool>& fitted) {
  std::vector<int> columns;
  int next = 1;
  for (const bool one : fitted) columns.push_back(one ? next++ : -1);
  return columns;
}

/// Normal equations with Huber's weights at the current parameters.
Normal normal_at(const std::vector<FluxEquation>& equations, const LightFit& fit, double huber) {
  const std::vector<int> columns = columns_of_orders(fit.determined);
  const auto size = 1 + std::count(fit.determined.begin(), fit.determined.end(), true);
  Normal sum{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
  for (const FluxEquation& e : equations) {
    const double residual = fit.residual(e), off = std::abs(residual) / e.sigma;
    const double weight = (off <= huber ? 1 : huber / off) / (e.sigma * e.sigma);
    const double by_order = 1 / (fit.orders[e.lamp] + 1) + e.log_cos;
    const int column = columns[e.lamp];
    sum.matrix(0, 0) += weight;
    sum.rhs[0] += weight * residual;
    sum.chi2 += weight * residual * residual;
    if (column < 0) continue;
    sum.matrix(column, 0) += weight * by_order;
    sum.matrix(0, column) += weight * by_order;
    sum.matrix(column, column) += weight * by_order * by_order;
    sum.rhs[column] += weight * residual * by_order;
  }
  return sum;
}

/// Gauss-Newton iteration; false without convergence.
bool iterate(const std::vector<FluxEquation>& equations, double huber, LightFit& fit) {
  const std::vector<int> columns = columns_of_orders(fit.determined);
  for (int step = 0; step < max_steps; ++step) {
    const Normal normal = normal_at(equations, fit, huber);
    const Eigen::LLT<Eigen::MatrixXd> solver(normal.matrix);
    if (solver.info() != Eigen::Success) return false;
    const Eigen::VectorXd d = solver.solve(normal.rhs);
    if (!d.allFinite()) return false;
    double largest = std::abs(d[0]);
    fit.scale += d[0];
    for (std::size_t lamp = 0; lamp < columns.size(); ++lamp) {
      if (columns[lamp] < 0) continue;
      double& order = fit.orders[static_cast<Eigen::Index>(lamp)];
      const double before = order;
      order = std::clamp(order + d[columns[lamp]], min_order, max_order);
      largest = std::max(largest, std::abs(order - before));
    }
    if (largest < 1e-9) return true;
  }
  return false;
}

void write_result(const std::vector<FluxEquation>& equations, double huber, LightFit& fit) {
  const Normal normal = normal_at(equations, fit, huber);
  const Eigen::Index size = normal.matrix.rows();
  fit.chi2 = normal.chi2;
  fit.dof = static_cast<int>(equations.size()) - static_cast<int>(size);
  fit.variance_factor = variance_factor(fit.chi2, fit.dof);
  const Eigen::MatrixXd known =
      fit.variance_factor * normal.matrix.llt().solve(Eigen::MatrixXd::Identity(size, size));
  std::vector<int> columns = columns_of_orders(fit.determined);
  columns.insert(columns.begin(), 0);
  const auto all = static_cast<Eigen::Index>(columns.size());
  fit.covariance = Eigen::MatrixXd::Zero(all, all);
  for (Eigen::Index i = 0; i < all; ++i)
    for (Eigen::Index j = 0; j < all; ++j) {
      const int a = columns[i], b = columns[j];
      if (a >= 0 && b >= 0) fit.covariance(i, j) = known(a, b);
      if (i == j && a < 0) fit.covariance(i, j) = std::numeric_limits<double>::infinity();
    }
}

/// The fitted lamp with the smallest range of angles; -1: none.
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

/// The lamp whose order must be held: one at a limit of the orders, or else the one with the
/// largest sigma above max_order_sigma; -1: none.
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
                   const FitLimits& limits) {
  constexpr std::size_t min_equations = 3;
  std::vector<std::size_t> counts(static_cast<std::size_t>(orders.size()));
  for (const FluxEquation& e : equations) ++counts[e.lamp];
  LightFit start;
  start.orders = orders;
  for (const std::size_t count : counts) start.determined.push_back(count >= min_equations);
  for (;;) {
    LightFit fit = start;
    const bool converged = iterate(equations, limits.huber_sigma, fit);
    if (converged) write_result(equations, limits.huber_sigma, fit);
    const int lamp = converged ? undetermined(fit, limits.max_order_sigma)
                               : narrowest(equations, fit.determined);
    if (lamp < 0) {
      if (!converged) write_result(equations, limits.huber_sigma, fit);  // the weights may alternate
      return fit;
    }
    start.determined[lamp] = false;
  }
}

}  // namespace occ::internal::photometry
