// SPDX-License-Identifier: Apache-2.0
// Internal: from a problem to the answer of identify().
#pragma once

#include "libocc/identify/problem.hpp"

namespace occ::naming {

/// Throws std::invalid_argument for blobs that are not finite.
void check(const std::vector<Blob>& blobs);

LIBOCC_API Result<Identification> verdict(const AssignmentProblem& problem);

}  // namespace occ::naming
