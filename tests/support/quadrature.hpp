// SPDX-License-Identifier: Apache-2.0
// Numerical integration and the pixel's PSF from the standard library: oracles of the tests of
// coverage and of the renderer.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace occ::test {

/// Nodes (x) and weights (y) on [-1/2, 1/2]: panels of the 4-point Gauss-Legendre rule.
inline std::vector<Eigen::Vector2d> quadrature(int panels) {
  constexpr std::array<double, 4> node = {-0.8611363115940526, -0.3399810435848563,
                                          0.3399810435848563, 0.8611363115940526};
  constexpr std::array<double, 4> weight = {0.3478548451374538, 0.6521451548625461,
                                            0.6521451548625461, 0.3478548451374538};
  std::vector<Eigen::Vector2d> nodes;
  for (int panel = 0; panel < panels; ++panel)
    for (std::size_t i = 0; i < 4; ++i)
      nodes.emplace_back((2 * panel + 1 + node[i]) / panels / 2 - 0.5, weight[i] / panels / 2);
  return nodes;
}

/// Integral of f over [from, to], panels no wider than `step`.
inline double integrate(const std::function<double(double)>& f, double from, double to,
                        double step) {
  double sum = 0;
  for (const Eigen::Vector2d& node : quadrature(static_cast<int>(std::ceil((to - from) / step))))
    sum += node.y() * f(0.5 * (from + to) + node.x() * (to - from));
  return sum * (to - from);
}

/// Light of a Gaussian PSF that a pixel (a box of width 1) collects at offset u along one axis.
inline double box_blurred(double u, double sigma) {
  const auto cumulative = [&](double z) { return 0.5 * std::erfc(-z / sigma * std::sqrt(0.5)); };
  return cumulative(u + 0.5) - cumulative(u - 0.5);
}

/// Adds a point source at `px`, times `light`, to an image of (columns, rows).
inline void add_dot(Eigen::MatrixXd& image, const Eigen::Vector2d& px, double sigma, double light) {
  const double reach = 8 * sigma + 1;
  const auto from = [&](double at) {
    return static_cast<Eigen::Index>(std::max(0.0, std::floor(at - reach)));
  };
  const auto to = [&](double at, Eigen::Index size) {
    return std::min(size, static_cast<Eigen::Index>(std::max(0.0, std::ceil(at + reach))));
  };
  const Eigen::Index x1 = to(px.x(), image.rows()), y1 = to(px.y(), image.cols());
  for (Eigen::Index y = from(px.y()); y < y1; ++y) {
    const double row = light * box_blurred(static_cast<double>(y) - px.y(), sigma);
    for (Eigen::Index x = from(px.x()); x < x1; ++x)
      image(x, y) += row * box_blurred(static_cast<double>(x) - px.x(), sigma);
  }
}

}  // namespace occ::test
