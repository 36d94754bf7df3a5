// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/normal_quantile.hpp"

#include <cmath>
#include <initializer_list>

#include "libocc/core/math.hpp"

namespace occ::internal::network {

namespace {

/// Continued fraction of the incomplete beta function (Lentz; Press et al., "Numerical recipes",
/// section 6.4).
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

/// Probability that a beta variable is below x.
double beta_probability(double a, double b, double x) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1) / (a + b + 2)) return front * beta_fraction(a, b, x) / a;
  return 1 - front * beta_fraction(b, a, 1 - x) / b;
}

/// Probability that |t| is above.
double student_beyond(double t, double dof) {
  return beta_probability(dof / 2, 0.5, dof / (dof + t * t));
}

}  // namespace

double normal_probability(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

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

}  // namespace occ::internal::network
