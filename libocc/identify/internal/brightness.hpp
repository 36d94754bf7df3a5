// SPDX-License-Identifier: Apache-2.0
// Internal: whether an explanation's blobs are as bright and as large as its lamps would look from
// its pose: fluxes up to one common gain, as exposure and aperture may be anything.
#pragma once

#include "libocc/identify/internal/explain.hpp"

namespace occ::internal::identify {

Brightness brightness_of(const AssignmentProblem& problem, const PoseHypothesis& e);

/// Fills in the brightness of all, and counts it in the chi-square of several when one of those
/// that are worth most is as bright as its lamps let expect; when none is, the map's powers are not
/// these lamps'. The order stays that of `found`, but for those of one worth.
void weigh_by_brightness(const AssignmentProblem& problem, std::vector<PoseHypothesis>& found);

/// Leaves out what explains reflections: other blobs than a better one, for some of the same lamps,
/// and fainter by more than errors make them. Returns how many.
int drop_reflections(const AssignmentProblem& problem, std::vector<PoseHypothesis>& found);

/// The problem of the blobs that `e` leaves, when these are at least four and most of them brighter
/// than those that it explains: what it explains may be reflections.
std::optional<AssignmentProblem> brighter_rest(const AssignmentProblem& problem,
                                               const PoseHypothesis& e);

/// Whether `strong`, found among what `weak` leaves, shows that this is a reflection.
bool outshines(const Brightness& strong, const Brightness& weak);

}  // namespace occ::internal::identify
