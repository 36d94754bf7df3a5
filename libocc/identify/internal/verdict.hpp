// SPDX-License-Identifier: Apache-2.0
// Verdict on the hypotheses of a search: their probabilities, the risk of the best one, and the
// status (pose/internal/evidence.hpp).
#pragma once

#include <string>

#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/pose/internal/evidence.hpp"

namespace occ::internal::identify {

/// Hypotheses of a smaller probability are not listed.
inline constexpr double min_listed_probability = 1e-6;

/// The poses are no answer where it is more probable that none of them is right.
inline constexpr double accidental = 0.5;

/// A pose of fewer pairs may have a rival that a search which was cut short has missed.
inline constexpr std::size_t strong_matches = 6;

/// Sum of the likelihoods, over that of the best pose, of poses which a wrong part of the prior
/// excluded from the search: a pose as good as the best one may be among them.
inline constexpr double excluded_by_prior = 0.1;

/// Evidence of each hypothesis, in their order.
std::vector<pose::LogEvidence> evidences_of(const AssignmentProblem& problem,
                                            const std::vector<Hypothesis>& hypotheses);

/// Sets the probabilities and the risk, sorts the hypotheses by probability, merges those of one
/// pose and removes those of negligible probability. Sets the status and puts the reason before the
/// message. Nothing happens without hypotheses.
void conclude(const AssignmentProblem& problem, Result<Identification>& result);

/// Names the rivals of the best pose and the probability `none` that no pose is right. `poses`: how
/// many match the image; `best`: probability of the best one; `symmetries` of the map that relate
/// them, may be empty.
LIBOCC_API std::string doubt_message(std::size_t poses, double best, double none,
                                     const std::string& symmetries = "");

}  // namespace occ::internal::identify
