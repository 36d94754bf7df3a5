// SPDX-License-Identifier: Apache-2.0
// Fills in a fix from its candidates.
#pragma once

#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/locate/fix.hpp"

namespace occ::internal::locate {

/// Copies pose, covariance and lamps of the first candidate.
LIBOCC_API void take_best(Fix& fix);

/// Sets the probabilities of the candidates, best first, and the risk, for known correspondences:
/// their likelihoods e^(-chi2 / (2 misfit)) over the sum of all. `excluded`: sum of the
/// likelihoods, over that of the best, of poses that are no candidates.
LIBOCC_API void weigh(Fix& fix, double misfit, double excluded = 0);

/// Number of poses that fit, and the probability of the best one.
LIBOCC_API std::string rivals_message(const Fix& fix);

/// Order of results, best first: located, whether or not a budget was met; ambiguous; others.
inline int rank(Status status) {
  if (status == Status::ok || status == Status::budget_not_met) return 0;
  return status == Status::ambiguous ? 1 : 2;
}

}  // namespace occ::internal::locate
