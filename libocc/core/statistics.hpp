// SPDX-License-Identifier: Apache-2.0
// What the residuals say about the sigmas they were weighted by.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ {

/// chi2 / dof when chi2 is beyond its 99.9 % quantile, else 1: the factor of a covariance whose
/// sigmas were stated too small. Quantile: Wilson, Hilferty, "The distribution of chi-square", PNAS
/// 17, 1931.
LIBOCC_API double variance_factor(double chi2, int dof);

}  // namespace occ
