// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/map_rivals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/refine/internal/estimated_map.hpp"
#include "libocc/refine/internal/lamp_contradictions.hpp"

namespace occ::internal::locate {

using namespace internal::refine;

namespace {

std::vector<std::pair<int, int>> pairs_of(const std::vector<Match>& matches) {
  std::vector<std::pair<int, int>> pairs;
  for (const Match& match : matches) pairs.emplace_back(match.lamp, match.blob);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

bool same_assignment(const RankedPose& a, const RankedPose& b) {
  return pairs_of(a.hypothesis->matches) == pairs_of(b.hypothesis->matches);
}

/// Upper limit of the errors of the map that the lamps' contradictions allow.
double max_map_sigma_m(const Refined& refined) {
  int dof = -6;
  for (const LampResidual& lamp : refined.lamps)
    if (!lamp.contradicts) dof += lamp.rung == Rung::rims ? 3 : 2;
  return *refined.estimated_map_sigma_m * std::sqrt(few_lamps_factor(std::max(1, dof)));
}

}  // namespace

void append_rivals(std::vector<RankedPose> rivals, Refinement& refinement) {
  double sum = 1;
  for (RankedPose& rival : rivals) {
    sum += rival.probability;
    refinement.poses.push_back(std::move(rival));
  }
  for (RankedPose& pose : refinement.poses) pose.probability /= sum;
  refinement.none /= sum;
  std::stable_sort(
      refinement.poses.begin(), refinement.poses.end(),
      [](const RankedPose& a, const RankedPose& b) { return a.probability > b.probability; });
}

void add_rivals_of_wrong_map(const RefinementAhead& ahead, const std::function<double()>& elapsed_s,
                             std::deque<Hypothesis>& found, Refinement& refinement) {
  const RankedPose& best = refinement.poses.front();
  if (!best.refined.ok() || !best.refined->estimated_map_sigma_m) return;
  const Scene scene = with_map_errors(ahead.scene, max_map_sigma_m(*best.refined));
  const Result<Identification> again =
      identify::search_hypotheses(ahead.blobs, scene, ahead.identify);
  if (again->hypotheses.empty()) return;
  const RefinementAhead loose{again->hypotheses, ahead.blobs,           scene,
                              ahead.options,     ahead.costs,           ahead.max_candidates,
                              ahead.identify,    ahead.budget_s,        ahead.target_sigma_m,
                              nullptr,           again->excluded_listed};
  Refinement refined = refine_hypotheses(loose, elapsed_s);
  double of_best = 0;
  for (const RankedPose& pose : refined.poses)
    if (same_assignment(pose, best)) of_best += pose.probability;
  std::vector<RankedPose> rivals;
  for (RankedPose& pose : refined.poses) {
    const bool is_known =
        std::any_of(refinement.poses.begin(), refinement.poses.end(),
                    [&](const RankedPose& other) { return same_assignment(pose, other); });
    if (is_known || !pose.fits) continue;
    // Both fits allow for the same errors, so their probabilities are comparable. The verdict shall
    // be doubt if the search does not find the best pose again.
    constexpr double smallest = 0.01;
    pose.probability *= best.probability / std::max(of_best, smallest);
    found.push_back(*pose.hypothesis);
    pose.hypothesis = &found.back();
    rivals.push_back(std::move(pose));
  }
  append_rivals(std::move(rivals), refinement);
}

}  // namespace occ::internal::locate
