// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/internal/hermite_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace occ::internal::radiometry {
namespace {

double minmod(double a, double b) {
  if (!(a * b > 0)) return 0;
  return std::abs(a) < std::abs(b) ? a : b;
}

// Slope at node i of the polynomial through it and up to two neighbours on each side.
double polynomial_slope(const std::vector<double>& at, const std::vector<double>& values,
                        std::size_t i) {
  const std::size_t first = i < 2 ? 0 : i - 2, last = std::min(i + 2, at.size() - 1);
  double slope = 0;
  for (std::size_t j = first; j <= last; ++j) {
    if (j == i) continue;
    double weight = 1 / (at[j] - at[i]);
    for (std::size_t k = first; k <= last; ++k)
      if (k != i && k != j) weight *= (at[i] - at[k]) / (at[j] - at[k]);
    slope += weight * (values[j] - values[i]);
  }
  return slope;
}

// One cell of a grid axis, and the cubic Hermite basis in it: the weights of the values and slopes
// at its ends, for the value and for the derivative.
struct HermiteCell {
  HermiteCell(const std::vector<double>& nodes, double position) {
    if (nodes.size() < 2) return;
    const double inside = std::clamp(position, nodes.front(), nodes.back());
    const auto above = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, inside);
    low = static_cast<Eigen::Index>(above - nodes.begin()) - 1;
    const double h = *above - *(above - 1), t = (inside - *(above - 1)) / h, u = 1 - t;
    value = {(1 + 2 * t) * u * u, t * t * (3 - 2 * t), h * t * u * u, -h * t * t * u};
    slope = {-6 * t * u / h, 6 * t * u / h, u * (1 - 3 * t), t * (3 * t - 2)};
    high = low + 1;
  }

  Eigen::Index low = 0, high = 0;
  std::array<double, 4> value{1, 0, 0, 0}, slope{};
};

double blend(const std::array<double, 4>& w, double low, double high, double low_slope,
             double high_slope) {
  return w[0] * low + w[1] * high + w[2] * low_slope + w[3] * high_slope;
}

// Slopes of each column of `values` along its rows.
Eigen::MatrixXd slopes_along(const std::vector<double>& at, const Eigen::MatrixXd& values) {
  Eigen::MatrixXd slopes(values.rows(), values.cols());
  std::vector<double> column(at.size());
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      column[static_cast<std::size_t>(i)] = values(i, j);
    const std::vector<double> found = limited_slopes(at, column);
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      slopes(i, j) = found[static_cast<std::size_t>(i)];
  }
  return slopes;
}

// Limits slopes of values >= 0 so that the cubics do not become negative (Schmidt and Hess,
// "Positivity of cubic polynomials on intervals", BIT 28 (1988)).
void keep_positive(const std::vector<double>& at, const Eigen::MatrixXd& values,
                   Eigen::MatrixXd& slopes) {
  const Eigen::Index n = values.rows();
  for (Eigen::Index j = 0; j < values.cols(); ++j)
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      double& slope = slopes(i, j);
      if (i + 1 < n) slope = std::max(slope, -3 * values(i, j) / (at[k + 1] - at[k]));
      if (i > 0) slope = std::min(slope, 3 * values(i, j) / (at[k] - at[k - 1]));
    }
}

}  // namespace

std::vector<double> limited_slopes(const std::vector<double>& at,
                                   const std::vector<double>& values) {
  const std::size_t n = at.size();
  std::vector<double> slopes(n, 0.0);
  if (n < 2) return slopes;
  std::vector<double> steps(n - 1), secants(n - 1), second(n, 0.0);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    steps[i] = at[i + 1] - at[i];
    secants[i] = (values[i + 1] - values[i]) / steps[i];
  }
  for (std::size_t i = 1; i + 1 < n; ++i)
    second[i] = (secants[i] - secants[i - 1]) / (steps[i - 1] + steps[i]);
  if (n > 2) second.front() = second[1], second.back() = second[n - 2];

  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double left = secants[i - 1], right = secants[i];
    const double from_left = left + minmod(second[i - 1], second[i]) * steps[i - 1];
    const double from_right = right - minmod(second[i], second[i + 1]) * steps[i];
    const double t = minmod(from_left, from_right);
    const double limit = std::max(3 * std::abs(minmod(left, right)), 1.5 * std::abs(t));
    slopes[i] = minmod(polynomial_slope(at, values, i), std::copysign(limit, t));
  }
  slopes.front() = minmod(polynomial_slope(at, values, 0), 3 * secants.front());
  slopes.back() = minmod(polynomial_slope(at, values, n - 1), 3 * secants.back());
  return slopes;
}

void HermiteGrid::set_slopes() {
  f_x = slopes_along(x, f);
  keep_positive(x, f, f_x);
  Eigen::MatrixXd transposed = slopes_along(y, f.transpose());
  keep_positive(y, f.transpose(), transposed);
  f_y = transposed.transpose();
  f_xy = slopes_along(y, f_x.transpose()).transpose();
}

SurfacePoint HermiteGrid::at(double px, double py) const {
  const HermiteCell a(x, px), b(y, py);
  const auto along_x = [&](const std::array<double, 4>& w, Eigen::Index j) {
    return blend(w, f(a.low, j), f(a.high, j), f_x(a.low, j), f_x(a.high, j));
  };
  const auto turn_along_x = [&](const std::array<double, 4>& w, Eigen::Index j) {
    return blend(w, f_y(a.low, j), f_y(a.high, j), f_xy(a.low, j), f_xy(a.high, j));
  };
  const auto along_y = [&](const std::array<double, 4>& wx, const std::array<double, 4>& wy) {
    return blend(wy, along_x(wx, b.low), along_x(wx, b.high), turn_along_x(wx, b.low),
                 turn_along_x(wx, b.high));
  };
  return {along_y(a.value, b.value), along_y(a.slope, b.value), along_y(a.value, b.slope)};
}

}  // namespace occ::internal::radiometry
