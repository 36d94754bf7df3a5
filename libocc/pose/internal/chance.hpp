// SPDX-License-Identifier: Apache-2.0
// Internal: how often chance alone brings so many points together. Of n points k agree with a pose
// found from m of them, when each agrees with any pose with probability p; the expected number of
// such poses is below
//     NFA = (n - m) r C(n, k) C(k, m) p^(k - m)
// with r poses for m points (Moisan, Stival, "A probabilistic criterion to detect rigid point
// matches between two images and estimate the fundamental matrix", IJCV 57, 2004, eq (19)).
#pragma once

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

struct ChancePoses {
  int points = 0;     ///< n
  int sample = 3;     ///< m
  int poses = 4;      ///< r
  double chance = 1;  ///< p
};

/// Natural logarithm of NFA for k that agree.
LIBOCC_API double log_false_alarms(const ChancePoses& problem, int agree);

/// The fewest that agree with an NFA of at most `most`; n + 1 when not even all do.
LIBOCC_API int min_agreement(const ChancePoses& problem, double most);

}  // namespace occ::internal::pose
