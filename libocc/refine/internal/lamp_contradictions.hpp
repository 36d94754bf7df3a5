// SPDX-License-Identifier: Apache-2.0
// Contradictions between lamps as wholes. Errors of map and camera are one for each lamp, however
// many points its rim has.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/observations.hpp"

namespace occ::internal::refine {

/// Enlarges a covariance whose variance factor was estimated from `dof` values, so that three sigma
/// of the normal distribution are those of Student's distribution.
double few_lamps_factor(int dof);

/// Chi-square of the lamps as wholes (LampObservation::own_chi2) over its degrees of freedom; 1
/// unless it exceeds its 99.9 % quantile. Stated errors are contained.
struct LampContradiction {
  double factor = 1;
  int dof = 0;
};
LampContradiction contradiction_of(const std::vector<LampObservation>& lamps);

}  // namespace occ::internal::refine
