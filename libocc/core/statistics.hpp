// SPDX-License-Identifier: Apache-2.0
// Distribution functions, their quantiles, and order statistics.
#pragma once

#include <cmath>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Probability that a standard normal variable is below z.
inline double normal_probability(double z) { return 0.5 * std::erfc(-z * std::sqrt(0.5)); }

/// z with normal_probability(z) == p, for 0 < p < 1. Halley steps from the approximation of
/// Hastings (Abramowitz, Stegun, "Handbook of mathematical functions", 1964, eq. 26.2.23).
LIBOCC_API double normal_quantile(double p);

/// Quantile of Student's t distribution with `dof` >= 1 degrees of freedom, for 0 < p < 1:
/// bisection of the incomplete beta function (Press et al., "Numerical recipes", 3rd edition,
/// section 6.14.3).
LIBOCC_API double student_quantile(double p, int dof);

/// Chi-square value with `dof` > 0 degrees of freedom that is exceeded with the probability that a
/// standard normal variable exceeds `gate_sigma`. Approximation of Wilson and Hilferty, "The
/// distribution of chi-square", PNAS 17, 1931; at least 0.
LIBOCC_API double gate_chi2(double gate_sigma, double dof);

/// Variance factor of residuals: chi2 / dof if chi2 exceeds its 99.9 % quantile (gate_chi2),
/// else 1. It multiplies a covariance whose sigmas were stated too small. 1 for dof <= 0.
LIBOCC_API double variance_factor(double chi2, int dof);

/// Probability that a chi-square variable of `dof` > 0 degrees of freedom (any real number) is
/// below chi2 >= 0; the regularised incomplete gamma function to 1e-14. Series and continued
/// fraction: Press et al., "Numerical recipes", 3rd edition, eqs. (6.2.5) and (6.2.7).
LIBOCC_API double chi2_probability(double chi2, double dof);

/// Inverse of chi2_probability for a probability in [0, 1); relative error 1e-10. Both functions
/// throw std::invalid_argument for arguments out of range.
LIBOCC_API double chi2_quantile(double probability, double dof);

/// Median; the upper of the two middle values if their number is even; 0 if there is none.
LIBOCC_API double median(std::vector<double> values);

/// Sorted value of index ceil(part (n - 1)), for part in [0, 1]; infinite if there is none.
LIBOCC_API double quantile(std::vector<double> values, double part);

}  // namespace occ
