// SPDX-License-Identifier: Apache-2.0
// Compares the fluxes and sizes of a hypothesis' blobs with those predicted for its lamps and pose.
// Fluxes are compared up to one common gain, because exposure and aperture may be unknown.
#pragma once

#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {

Brightness brightness_of(const AssignmentProblem& problem, const PoseHypothesis& e);

/// ln of the density of the fluxes if the blobs are these lamps, up to a common gain, over that if
/// they are false lights: of one kind, with the fluxes of equal lamps, or of any fluxes, uniform in
/// ln over three decades. Lamps of equal power are therefore no evidence.
double log_flux_ratio(const AssignmentProblem& problem, const PoseHypothesis& e);

/// Sets the brightness of all hypotheses and adds it to their chi-square, provided that one of
/// those with the most pairs fits the map; otherwise the powers in the map are assumed to be wrong.
/// Sorts the hypotheses that have as many pairs as the first one by chi-square.
void rank_by_brightness(const AssignmentProblem& problem, std::vector<PoseHypothesis>& found);

/// Removes hypotheses that match reflections: they share no blob with another hypothesis, and their
/// lamps are fainter by more than the errors permit. Returns the number removed.
int drop_reflections(const AssignmentProblem& problem, std::vector<PoseHypothesis>& found);

/// Returns the problem of the observations that `e` does not use. Empty unless at least four of
/// these have a flux and their median exceeds that of the used ones: then `e` may match
/// reflections.
std::optional<AssignmentProblem> brighter_remainder(const AssignmentProblem& problem,
                                                    const PoseHypothesis& e);

/// True if `strong` is so much brighter than `weak` that the latter matches reflections.
bool is_brighter(const Brightness& strong, const Brightness& weak);

}  // namespace occ::internal::identify
