// SPDX-License-Identifier: Apache-2.0
// Evidence for a hypothesis from the places, sizes, fluxes and codes of its blobs, the lamps that
// it misses, the blobs that it leaves and the prior (pose/internal/evidence.hpp). Rims do not
// count: only refinement models them.
#pragma once

#include <functional>
#include <optional>

#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/pose/internal/evidence.hpp"

namespace occ::internal::identify {

/// Input of pose::log_evidence(). Lamps behind the camera count as missed. `powers_fit`: the powers
/// in the map are right, so that fluxes which contradict them count in full.
pose::PoseEvidence evidence_of(const AssignmentProblem& problem, const PoseHypothesis& hypothesis,
                               const std::optional<Prior>& prior, bool powers_fit);

/// Share of all rotations of a camera that show at least a few lamps of a map. The optical axis
/// points at the map, to within the angle of view or the map's angular radius, if that is larger.
double rotations_in_view(const Camera& camera, double map_radius_m, double distance_m);

/// Volume whose inverse is the density of the camera's position: uniform in direction and in ln of
/// the distance from the middle of the map, over two decades. Positions are relative to the middle.
LIBOCC_API double volume_m3(double map_radius_m, double distance_m);

/// Parts of a prior at a pose, with the probability that each is wrong: a last pose if the camera
/// was carried away or the pose before was wrong, the others if they were stated wrongly.
LIBOCC_API std::vector<pose::PriorPart> prior_parts(const Prior& prior,
                                                    const Rigid3& cam_from_world);

/// Probability that a last pose is off by more than stated.
inline constexpr double last_pose_wrong = 1e-2;
Prior without_last_pose(Prior prior);

/// Parts of a prior that a pose which the prior excludes leaves to be believed: all but the last
/// pose if only that excludes it, otherwise none.
std::optional<Prior> believed_at(const Prior& prior, const Rigid3& excluded);

/// ln of the probability that a prior which excludes this pose is wrong.
double log_misstated(const Prior& prior, const Rigid3& excluded);

/// Probability of a pose that the prior excludes over that of the best pose; `log_ratio` is ln of
/// that of their evidence with a given prior. If only the last pose excludes it, that is of another
/// place that looks alike. In a regular map nothing else excludes that place, so every pose there
/// has at least this risk. Otherwise the prior, or one part of it, is misstated.
double share_of_excluded(const Prior& prior, const Rigid3& excluded,
                         const std::function<double(const std::optional<Prior>&)>& log_ratio);

}  // namespace occ::internal::identify
