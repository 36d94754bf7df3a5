// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/internal/polynomial.hpp"

#include <algorithm>
#include <cstddef>

namespace occ::internal::camera {

namespace {

double bisect(const Polynomial& p, double low, double high) {
  const bool negative_low = evaluate(p, low) < 0;
  while (true) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) return high;
    ((evaluate(p, middle) < 0) == negative_low ? low : high) = middle;
  }
}

}  // namespace

double evaluate(const Polynomial& p, double x) {
  double value = 0;
  for (auto c = p.rbegin(); c != p.rend(); ++c) value = value * x + *c;
  return value;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial d;
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(static_cast<double>(i) * p[i]);
  return d;
}

Polynomial product(const Polynomial& p, const Polynomial& q) {
  if (p.empty() || q.empty()) return {};
  Polynomial r(p.size() + q.size() - 1, 0.0);
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (std::size_t j = 0; j < q.size(); ++j) r[i + j] += p[i] * q[j];
  }
  return r;
}

Polynomial sum(const Polynomial& p, double factor, const Polynomial& q) {
  Polynomial r(std::max(p.size(), q.size()), 0.0);
  for (std::size_t i = 0; i < p.size(); ++i) r[i] += p[i];
  for (std::size_t i = 0; i < q.size(); ++i) r[i] += factor * q[i];
  return r;
}

std::vector<double> sign_changes(const Polynomial& p, double limit) {
  if (p.size() < 2) return {};
  std::vector<double> edges = sign_changes(derivative(p), limit);
  edges.push_back(limit);
  std::vector<double> roots;
  double low = 0;
  for (const double high : edges) {
    if ((evaluate(p, low) < 0) != (evaluate(p, high) < 0)) roots.push_back(bisect(p, low, high));
    low = high;
  }
  return roots;
}

}  // namespace occ::internal::camera
