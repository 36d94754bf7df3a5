// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

/// Sentence for a problem without a pose: empty unless one is found when the sizes of the blobs are
/// ignored, and these differ from those of the lamps by a common factor.
std::string advice_on_sizes(const AssignmentProblem& problem);

}  // namespace occ::internal::identify
