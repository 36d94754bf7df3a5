// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/statistics.hpp"

#include <cmath>

namespace occ {

double variance_factor(double chi2, int dof) {
  constexpr double z = 3.0902;
  if (dof <= 0) return 1;
  const double a = 2.0 / (9.0 * dof);
  const double quantile = dof * std::pow(1 - a + z * std::sqrt(a), 3);
  return chi2 > quantile ? chi2 / dof : 1;
}

}  // namespace occ
