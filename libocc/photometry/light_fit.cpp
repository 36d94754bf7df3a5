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
constexpr double smallest_order = 0.05, largest_order = 200;

struct Normal {
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

/// Huber's weights where the parameters are now.
Normal normal_at(const std::vector<FluxEquation>& equations, const LightFit& fit, double huber) {
  const std::vector<int> places = places_of(fit.determined);
  const auto size = 1 + std::count(fit.determined.begin(), fit.determined.end(), true);
  Normal sum{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size), 0};
  for (const FluxEquation& e : equations) {
    const double left = fit.residual(e), off = std::abs(left) / e.sigma;
    const double weight = (off <= huber ? 1 : huber / off) / (e.sigma * e.sigma);
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

/// False when steps come to no end.
bool descend(const std::vector<FluxEquation>& equations, double huber, LightFit& fit) {
  const std::vector<int> places = places_of(fit.determined);
  for (int step = 0; step < max_steps; ++step) {
    const Normal normal = normal_at(equations, fit, huber);
    const Eigen::LLT<Eigen::MatrixXd> solver(normal.matrix);
    if (solver.info() != Eigen::Success) return false;
    const Eigen::VectorXd d = solver.solve(normal.right);
    if (!d.allFinite()) return false;
    double largest = std::abs(d[0]);
    fit.scale += d[0];
    for (std::size_t lamp = 0; lamp < places.size(); ++lamp) {
      if (places[lamp] < 0) continue;
      double& order = fit.orders[static_cast<Eigen::Index>(lamp)];
      const double before = order;
      order = std::clamp(order + d[places[lamp]], smallest_order, largest_order);
      largest = std::max(largest, std::abs(order - before));
    }
    if (largest < 1e-9) return true;
  }
  return false;
}

void state(const std::vector<FluxEquation>& equations, double huber, LightFit& fit) {
  const Normal normal = normal_at(equations, fit, huber);
  const Eigen::Index size = normal.matrix.rows();
  fit.chi2 = normal.chi2;
  fit.dof = static_cast<int>(equations.size()) - static_cast<int>(size);
  fit.variance_factor = variance_factor(fit.chi2, fit.dof);
  const Eigen::MatrixXd known =
      fit.variance_factor * normal.matrix.llt().solve(Eigen::MatrixXd::Identity(size, size));
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
    if (!(order > smallest_order && order < largest_order)) return lamp;
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
  return e.seen - scale - std::log(order + 1) - order * e.log_cos;
}

LightFit fit_light(const std::vector<FluxEquation>& equations, const Eigen::VectorXd& orders,
                   const FitLimits& limits) {
  constexpr std::size_t fewest = 3;
  std::vector<std::size_t> counts(static_cast<std::size_t>(orders.size()));
  for (const FluxEquation& e : equations) ++counts[e.lamp];
  LightFit start;
  start.orders = orders;
  for (const std::size_t count : counts) start.determined.push_back(count >= fewest);
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
