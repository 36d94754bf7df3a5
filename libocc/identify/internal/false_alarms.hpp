// SPDX-License-Identifier: Apache-2.0
// Internal: how many explanations as good as one chance would bring (a contrario: Desolneux,
// Moisan, Morel, "From Gestalt Theory to Image Analysis", 2008). Let n blobs be anywhere in an
// area. A pose that three of them suggest explains k - 3 others by an accident of the probability
//     p = product_i (pi sqrt(det S_i) / area) * s^m / m!,   s = sum_i e_i' S_i^-1 e_i,  m = k - 3:
// the volume of the ball of radius sqrt(s), e_i being how far a blob is off the place, of
// covariance S_i, where those three alone expect its point. With N points, v of them facing the
// camera, so many explanations are possible that the expected number of those with the same p or
// less is at most
//     (n - 3) * 4 n (n - 1) (n - 2) C(N, 3) * C(n - 3, m) (v - 3)! / (v - k)! * p.
#pragma once

#include "libocc/identify/internal/problem.hpp"

namespace occ::internal::identify {

/// Base-10 logarithm of that, by the best three blobs of the hypothesis: in the area that all blobs
/// span and in the one that those explained span, whichever is more. Infinite for three and fewer.
LIBOCC_API double log10_false_alarms(const AssignmentProblem& problem,
                                     const Hypothesis& hypothesis);

/// Fewer blobs than this cannot be explained so well that log10_false_alarms is at most this,
/// unless they fit twice as well as is to be expected. More than all when not even all can.
int min_pairs(const AssignmentProblem& problem, double max_log10_false_alarms);

}  // namespace occ::internal::identify
