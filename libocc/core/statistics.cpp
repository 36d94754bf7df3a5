// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace occ {

double variance_factor(double chi2, int dof) {
  constexpr double z = 3.0902;
  if (dof <= 0) return 1;
  const double a = 2.0 / (9.0 * dof);
  const double quantile = dof * std::pow(1 - a + z * std::sqrt(a), 3);
  return chi2 > quantile ? chi2 / dof : 1;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace occ
