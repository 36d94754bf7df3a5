// SPDX-License-Identifier: Apache-2.0
// Internal: lamps that are seen on a line, and what then is left to a prior.
#pragma once

#include "libocc/identify/internal/explain.hpp"

namespace occ::internal::identify {

/// Whether lamps are on one line as far as the errors of their blobs let that be seen from a pose:
/// any turn about it then explains the image. Lamps that are only `attached` count as well.
bool on_a_line(const AssignmentProblem& problem, const std::vector<Pair>& pairs, const Rigid3& pose,
               const std::vector<Match>& attached = {});

/// The pose turned about the line through three lamps: where the prior is best served, all minima.
std::vector<Rigid3> turns_by_prior(const AssignmentProblem& problem, const Naming& naming,
                                   const Rigid3& pose);

}  // namespace occ::internal::identify
