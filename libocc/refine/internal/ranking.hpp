// SPDX-License-Identifier: Apache-2.0
// Refines the hypotheses of an identification, ranks them, and keeps those that are plausible.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "libocc/refine/internal/budget.hpp"

namespace occ::internal::refine {

/// Poses of a smaller probability are not named.
inline constexpr double min_named_probability = 1e-6;

/// A refined hypothesis and the quantities that rank it.
struct RankedPose {
  Result<Refined> refined;  ///< Status::no_pose as well if lamp sizes contradict the pose
  const Hypothesis* hypothesis = nullptr;
  bool fits = false;        ///< refined, or not converged yet
  bool unfinished = false;  ///< not converged yet
  double chi2 = 0;          ///< chi-square with the prior, and penalties of missed lamps
  double probability = 0;   ///< among the poses found and "none of these"
};

struct Refinement {
  RungChoice choice;
  std::deque<Hypothesis> roots;   ///< hypotheses of poses that identification did not find
  std::vector<RankedPose> poses;  ///< those worth naming, most probable first; at least one
  double none = 0;                ///< probability that none of the poses found is right
};

/// Chooses the rung (`elapsed_s` as in rung_for) and refines up to `ahead.max_candidates`
/// hypotheses that fit. Ranks by rims at most, which are the same observations for every pose;
/// pixels refine the plausible poses afterwards. Hypotheses that lead to one pose are merged.
Refinement refine_hypotheses(const RefinementAhead& ahead,
                             const std::function<double()>& elapsed_s);

}  // namespace occ::internal::refine
