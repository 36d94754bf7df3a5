// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/false_alarms.hpp"

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
double log_tests(const FalseAlarmModel& c) {
  return std::log(static_cast<double>(c.points - c.sample) * c.poses) +
         log_choose(c.points, c.sample);
}

}  // namespace

double log_false_alarms(const FalseAlarmModel& c, int inliers) {
  if (inliers <= c.sample) return std::numeric_limits<double>::infinity();
  const int rest = inliers - c.sample;
  return log_tests(c) + log_choose(c.points - c.sample, rest) + rest * std::log(c.probability);
}

int min_inliers(const FalseAlarmModel& c, double max_false_alarms) {
  if (c.points <= c.sample) return c.points + 1;
  double log_nfa = log_tests(c);
  const int others = c.points - c.sample;
  for (int rest = 1; rest <= others; ++rest) {
    log_nfa += std::log(c.probability * (others - rest + 1) / rest);
    // The product rises up to its largest term, where it is never small enough, and then falls.
    if (log_nfa <= std::log(max_false_alarms)) return c.sample + rest;
  }
  return c.points + 1;
}

}  // namespace occ::internal::pose
