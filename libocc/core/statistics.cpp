// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

constexpr int max_terms = 100000;  // the series need some sqrt(dof) terms

/// Common factor of the incomplete gamma functions: x^a exp(-x) / Gamma(a).
double gamma_factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

/// P(a, x), Press et al. eq. (6.2.5).
double below_by_series(double a, double x) {
  double term = 1 / a, sum = term;
  for (int k = 1; k < max_terms && term > 1e-17 * sum; ++k) sum += term *= x / (a + k);
  return gamma_factor(a, x) * sum;
}

/// Q(a, x), Press et al. eq. (6.2.7), by Lentz's method.
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

/// Probabilities that a chi-square variable is below and above, each without cancellation.
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

/// Continued fraction of the incomplete beta function by Lentz's method (Press et al., "Numerical
/// recipes", 3rd edition, eq. (6.4.5)).
double beta_fraction(double a, double b, double x) {
  constexpr double tiny = 1e-300;
  double c = 1, d = 1 - (a + b) * x / (a + 1);
  d = 1 / (std::abs(d) < tiny ? tiny : d);
  double h = d;
  for (int m = 1; m < 500; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    double step = 1;
    for (const double term : {even, odd}) {
      d = 1 + term * d;
      c = 1 + term / c;
      d = 1 / (std::abs(d) < tiny ? tiny : d);
      if (std::abs(c) < tiny) c = tiny;
      step = c * d;
      h *= step;
    }
    if (std::abs(step - 1) < 1e-15) break;
  }
  return h;
}

/// Regularised incomplete beta function: probability that a beta variable is below x.
double beta_probability(double a, double b, double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1) / (a + b + 2)) return front * beta_fraction(a, b, x) / a;
  return 1 - front * beta_fraction(b, a, 1 - x) / b;
}

/// Probability that |T| exceeds t.
double student_beyond(double t, double dof) {
  return beta_probability(dof / 2, 0.5, dof / (dof + t * t));
}

}  // namespace

double normal_quantile(double p) {
  if (p == 0.5) return 0;
  const bool upper = p > 0.5;
  const double tail = upper ? 1 - p : p;
  const double t = std::sqrt(-2 * std::log(tail));
  double z = t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                     (1 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
  for (int k = 0; k < 4; ++k) {
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2 * pi);
    const double off = 0.5 * std::erfc(z / std::sqrt(2.0)) - tail;
    z += off / (density + 0.5 * z * off);  // Halley
  }
  return upper ? z : -z;
}

double student_quantile(double p, int dof) {
  if (p == 0.5) return 0;
  const double both = 2 * (p > 0.5 ? 1 - p : p);
  double low = 0, high = 1;
  while (student_beyond(high, dof) > both && high < 1e150) high *= 2;
  for (int k = 0; k < 200 && high - low > 1e-14 * high; ++k) {
    const double middle = 0.5 * (low + high);
    (student_beyond(middle, dof) > both ? low : high) = middle;
  }
  const double t = 0.5 * (low + high);
  return p > 0.5 ? t : -t;
}

double gate_chi2(double gate_sigma, double dof) {
  const double a = 2.0 / (9.0 * dof);
  return dof * std::pow(std::max(0.0, 1 - a + gate_sigma * std::sqrt(a)), 3);
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
  // Uses the smaller tail: a probability close to 1 keeps its digits.
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

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = static_cast<std::ptrdiff_t>(std::ceil(std::clamp(part, 0.0, 1.0) * last));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

}  // namespace occ
