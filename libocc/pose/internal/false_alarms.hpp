// SPDX-License-Identifier: Apache-2.0
// Expected number of false alarms (a contrario model) of a pose from a consensus search.
//
// A pose is found from m of n points and k points are its inliers. If every point is an inlier of
// any pose with probability p by chance alone, the expected number of such poses is below
//     NFA = (n - m) r C(n, k) C(k, m) p^(k - m)
// with r poses for m points.
// Source: Moisan, Stival, "A probabilistic criterion to detect rigid point matches between two
// images and estimate the fundamental matrix", IJCV 57, 2004, eq (19).
#pragma once

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

struct FalseAlarmModel {
  int points = 0;          ///< n
  int sample = 3;          ///< m
  int poses = 4;           ///< r
  double probability = 1;  ///< p
};

/// Natural logarithm of NFA for k inliers.
LIBOCC_API double log_false_alarms(const FalseAlarmModel& model, int inliers);

/// Smallest number of inliers with an NFA of at most `max_false_alarms`; n + 1 if there is none.
LIBOCC_API int min_inliers(const FalseAlarmModel& model, double max_false_alarms);

}  // namespace occ::internal::pose
