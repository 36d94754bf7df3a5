// SPDX-License-Identifier: Apache-2.0
// Internal: from a problem to the answer of identify().
#pragma once

#include "libocc/identify/internal/problem.hpp"

namespace occ::internal::identify {

/// Throws std::invalid_argument for blobs that are not finite.
void check(const std::vector<Blob>& blobs);

LIBOCC_API Result<Identification> verdict(const AssignmentProblem& problem);

}  // namespace occ::internal::identify
