// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/excluded_poses.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/identify/internal/assignment_evidence.hpp"
#include "libocc/locate/internal/map_rivals.hpp"
#include "libocc/refine/internal/estimated_map.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"

namespace occ::internal::locate {

using namespace internal::refine;
namespace {

/// Probability of a pose that only the prior excludes, over that of the best pose.
double share_of_excluded(const RefinementAhead& ahead, const RankedPose& best,
                         const RankedPose& rival) {
  const auto log_ratio = [&](const std::optional<Prior>& prior) {
    const auto log_of = [&](const RankedPose& pose) {
      return pose::log_evidence(
                 evidence_of(*pose.refined, *pose.hypothesis, ahead.blobs, ahead.scene, prior))
          .value;
    };
    return log_of(rival) - log_of(best);
  };
  return identify::share_of_excluded(*ahead.options.prior, rival.hypothesis->cam_from_world,
                                     log_ratio);
}

}  // namespace

void add_excluded(const RefinementAhead& ahead, const std::vector<Hypothesis>& excluded,
                  Refinement& refinement) {
  const RankedPose& best = refinement.poses.front();
  if (excluded.empty() || !best.refined.ok()) return;
  RefineOptions options = ahead.options;
  options.rung = std::min(options.rung, Rung::rims);
  std::vector<RankedPose> rivals;
  for (const Hypothesis& hypothesis : excluded) {
    options.prior = identify::believed_at(*ahead.options.prior, hypothesis.cam_from_world);
    RankedPose rival;
    rival.refined = refine_as_stated(hypothesis.cam_from_world, hypothesis.matches, ahead.blobs,
                                     ahead.scene, options, nullptr);
    if (!rival.refined.ok()) continue;
    rival.hypothesis = &hypothesis;
    rival.fits = true;
    rival.probability = best.probability * share_of_excluded(ahead, best, rival);
    rivals.push_back(std::move(rival));
  }
  append_rivals(std::move(rivals), refinement);
}

bool take_excluded(const RefinementAhead& without_prior, const std::optional<Prior>& prior,
                   const std::function<double()>& elapsed_s, Refinement& refinement) {
  if (refinement.poses.front().fits || without_prior.hypotheses.empty()) return false;
  Refinement excluded = refine_hypotheses(without_prior, elapsed_s);
  const RankedPose& best = excluded.poses.front();
  if (!best.fits) return false;
  // The prior may be right, and the lamps may be others.
  const double misstated =
      std::exp(identify::log_misstated(*prior, best.hypothesis->cam_from_world));
  const double sum = excluded.none + (1 - excluded.none) * misstated;
  for (RankedPose& pose : excluded.poses) pose.probability *= misstated / sum;
  excluded.none /= sum;
  refinement = std::move(excluded);
  return true;
}

}  // namespace occ::internal::locate
