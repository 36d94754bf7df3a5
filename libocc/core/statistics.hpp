// SPDX-License-Identifier: Apache-2.0
// What measured numbers say: their median, whether residuals are as small as their sigmas, and the
// chi-square distribution.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// The chi-square that is exceeded as seldom as a normal variable exceeds so many sigmas: Wilson,
/// Hilferty, "The distribution of chi-square", PNAS 17, 1931.
LIBOCC_API double gate_chi2(double gate_sigma, int dof);

/// chi2 / dof when chi2 is beyond its 99.9 % quantile (gate_chi2), else 1: the factor of a
/// covariance whose sigmas were stated too small.
LIBOCC_API double variance_factor(double chi2, int dof);

/// Probability that a chi-square variable of `dof` > 0 degrees of freedom (need not be whole) is
/// below chi2; the regularised incomplete gamma function to 1e-14. Series and continued fraction:
/// Press et al., "Numerical recipes", 3rd edition, eqs (6.2.5) and (6.2.7).
LIBOCC_API double chi2_probability(double chi2, double dof);

/// The value that is not exceeded with this probability, in [0, 1); relative error 1e-10. Both
/// throw std::invalid_argument for arguments out of range.
LIBOCC_API double chi2_quantile(double probability, double dof);

/// The upper one of an even number; 0 of none.
LIBOCC_API double median(std::vector<double> values);

}  // namespace occ
