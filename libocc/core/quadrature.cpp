// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/quadrature.hpp"

#include <cmath>

#include "libocc/core/math.hpp"

namespace occ::internal::core {
namespace {

// Legendre's polynomial of degree n and its derivative, |x| < 1, by the three-term recurrence.
struct Legendre {
  double value, slope;
};
Legendre legendre(int n, double x) {
  double before = 1, value = x;
  for (int k = 2; k <= n; ++k) {
    const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
    before = value;
    value = next;
  }
  return {value, n * (x * value - before) / (x * x - 1)};
}

}  // namespace

std::vector<QuadratureNode> gauss_legendre(int count) {
  std::vector<QuadratureNode> nodes;
  for (int i = 0; i < count; ++i) {
    double x = -std::cos(pi * (i + 0.75) / (count + 0.5));  // good to 1/count^2
    for (int step = 0; step < 5; ++step) {
      const Legendre p = legendre(count, x);
      x -= p.value / p.slope;
    }
    const double slope = legendre(count, x).slope;
    nodes.push_back({0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope)});
  }
  return nodes;
}

}  // namespace occ::internal::core
