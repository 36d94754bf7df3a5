// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

constexpr int max_terms = 100000;  // some sqrt(dof) are needed

/// Of the incomplete gamma functions' common factor x^a exp(-x) / Gamma(a).
double gamma_factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

double below_by_series(double a, double x) {
  double term = 1 / a, sum = term;
  for (int k = 1; k < max_terms && term > 1e-17 * sum; ++k) sum += term *= x / (a + k);
  return gamma_factor(a, x) * sum;
}

/// By Lentz's method.
double above_by_fraction(double a, double x) {
  constexpr double tiny = 1e-300;
  double b = x + 1 - a, c = 1 / tiny, d = 1 / b, value = d;
  for (int k = 1; k < max_terms; ++k) {
    const double numerator = k * (a - k);
    b += 2;
    d = numerator * d + b;
    c = b + numerator / c;
    if (std::abs(d) < tiny) d = tiny;
    if (std::abs(c) < tiny) c = tiny;
    d = 1 / d;
    value *= c * d;
    if (std::abs(c * d - 1) < 1e-16) break;
  }
  return gamma_factor(a, x) * value;
}

/// Of a chi-square variable: {below, above}, each without cancellation.
std::pair<double, double> tails(double chi2, double dof) {
  const double a = dof / 2, x = chi2 / 2;
  if (x <= 0) return {0, 1};
  if (std::isinf(x)) return {1, 0};
  if (x < a + 1) {
    const double below = below_by_series(a, x);
    return {below, 1 - below};
  }
  const double above = above_by_fraction(a, x);
  return {1 - above, above};
}

}  // namespace

double gate_chi2(double gate_sigma, int dof) {
  const double a = 2.0 / (9.0 * dof);
  return dof * std::pow(1 - a + gate_sigma * std::sqrt(a), 3);
}

double variance_factor(double chi2, int dof) {
  constexpr double once_in_a_thousand = 3.0902;
  if (dof <= 0) return 1;
  return chi2 > gate_chi2(once_in_a_thousand, dof) ? chi2 / dof : 1;
}

double chi2_probability(double chi2, double dof) {
  require(chi2 >= 0, "chi2", chi2, "at least 0");
  require(dof > 0 && std::isfinite(dof), "dof", dof, "positive and finite");
  return tails(chi2, dof).first;
}

double chi2_quantile(double probability, double dof) {
  require(probability >= 0 && probability < 1, "probability", probability, "in [0, 1)");
  require(dof > 0 && std::isfinite(dof), "dof", dof, "positive and finite");
  if (probability == 0) return 0;
  // By the smaller tail, so that a probability close to 1 keeps its digits.
  const bool by_upper = probability > 0.5;
  const auto too_low = [&](double x) {
    const auto [below, above] = tails(x, dof);
    return by_upper ? above > 1 - probability : below < probability;
  };
  double low = 0, high = dof;
  while (too_low(high)) high *= 2;
  for (int k = 0; k < 2000 && high - low > 1e-13 * high; ++k) {
    const double middle = 0.5 * (low + high);
    (too_low(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace occ
