// SPDX-License-Identifier: Apache-2.0
// Evidence for a refined pose from its lamps: places, sizes, codes, missed lamps, false lights and
// the prior (pose/internal/evidence.hpp).
#pragma once

#include "libocc/identify/identify.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Input of pose::log_evidence(). Lamps that were left out as gross errors count as missed, their
/// blobs as false lights.
LIBOCC_API pose::PoseEvidence evidence_of(const Refined& refined, const Hypothesis& hypothesis,
                                          const std::vector<Blob>& blobs, const Scene& scene,
                                          const std::optional<Prior>& prior);

}  // namespace occ::internal::refine
