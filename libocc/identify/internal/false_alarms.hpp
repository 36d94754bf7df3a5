// SPDX-License-Identifier: Apache-2.0
// Expected number of false alarms (NFA) of a hypothesis, by a-contrario reasoning (Desolneux,
// Moisan, Morel, "From Gestalt Theory to Image Analysis", 2008).
//
// Background model: n blobs, independent and uniform in an area. A pose from three of them matches
// k - 3 others by chance with the probability
//     p = product_i (pi sqrt(det S_i) / area) * s^m / m!,   s = sum_i e_i' S_i^-1 e_i,  m = k - 3,
// the volume of the ball of radius sqrt(s). Here e_i is the offset of a blob from the position
// predicted by the three pairs, and S_i the covariance of that prediction. With N map points, v of
// them facing the camera, the expected number of hypotheses with the same p or less is at most
//     (n - 3) * 4 n (n - 1) (n - 2) C(N, 3) * C(n - 3, m) (v - 3)! / (v - k)! * p.
#pragma once

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

/// Base-10 logarithm of the NFA, minimised over the three pairs that define the pose. The area is
/// the bounding box of all blobs or that of the matched blobs, whichever gives the larger NFA.
/// Infinite for three pairs or fewer.
LIBOCC_API double log10_false_alarms(const AssignmentProblem& problem,
                                     const Hypothesis& hypothesis);

/// Minimum number of pairs for which log10_false_alarms can reach the limit, unless the pairs fit
/// twice as well as expected. Exceeds the number of blobs or points if no number suffices.
int min_pairs(const AssignmentProblem& problem, double max_log10_false_alarms);

}  // namespace occ::internal::identify
