// SPDX-License-Identifier: Apache-2.0
// Evidence for a refined pose from its lamps: places, sizes, codes, missed lamps, false lights and
// the prior (pose/internal/evidence.hpp).
#pragma once

#include "libocc/identify/identify.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

/// Probability that a last pose is off by more than stated.
inline constexpr double last_pose_wrong = 1e-2;
/// Probability that it is the pose of another place that looks alike. In a regular map nothing but
/// the last pose excludes that place, so every fix there has at least this risk.
inline constexpr double last_pose_elsewhere = 1e-5;

/// Input of pose::log_evidence(). Lamps that were left out as gross errors count as missed, their
/// blobs as false lights.
LIBOCC_API pose::PoseEvidence evidence_of(const Refined& refined, const Hypothesis& hypothesis,
                                          const std::vector<Blob>& blobs, const Scene& scene,
                                          const std::optional<Prior>& prior);

}  // namespace occ::internal::refine
