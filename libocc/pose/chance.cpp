// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/chance.hpp"

#include <cmath>
#include <limits>

namespace occ::internal::pose {
namespace {

double log_choose(int n, int k) {
  double sum = 0;
  for (int i = 1; i <= k; ++i) sum += std::log(static_cast<double>(n - k + i) / i);
  return sum;
}

// C(n, k) C(k, m) = C(n, m) C(n - m, k - m), and C(n - m, 0) = 1.
double log_tests(const ChancePoses& c) {
  return std::log(static_cast<double>(c.points - c.sample) * c.poses) +
         log_choose(c.points, c.sample);
}

}  // namespace

double log_false_alarms(const ChancePoses& c, int agree) {
  if (agree <= c.sample) return std::numeric_limits<double>::infinity();
  const int rest = agree - c.sample;
  return log_tests(c) + log_choose(c.points - c.sample, rest) + rest * std::log(c.chance);
}

int min_agreement(const ChancePoses& c, double most) {
  if (c.points <= c.sample) return c.points + 1;
  double log_nfa = log_tests(c);
  const int others = c.points - c.sample;
  for (int rest = 1; rest <= others; ++rest) {
    log_nfa += std::log(c.chance * (others - rest + 1) / rest);
    // Beyond its largest term the product falls, and before it is never small enough.
    if (log_nfa <= std::log(most)) return c.sample + rest;
  }
  return c.points + 1;
}

}  // namespace occ::internal::pose
