// SPDX-License-Identifier: Apache-2.0
// What measured numbers say: their median, and whether residuals are as small as their sigmas.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <vector>

namespace occ {

/// chi2 / dof when chi2 is beyond its 99.9 % quantile, else 1: the factor of a covariance whose
/// sigmas were stated too small. Quantile: Wilson, Hilferty, "The distribution of chi-square", PNAS
/// 17, 1931.
LIBOCC_API double variance_factor(double chi2, int dof);

/// The upper one of an even number; 0 of none.
LIBOCC_API double median(std::vector<double> values);

}  // namespace occ
