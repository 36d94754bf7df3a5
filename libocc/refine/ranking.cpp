// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/ranking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"

namespace occ::internal::refine {
namespace {

RankedPose refine_hypothesis(const RefinementAhead& ahead, const Hypothesis& hypothesis,
                             const Rigid3& start, const RefineOptions& given) {
  RefineOptions options = given;
  options.rung = std::min(options.rung, Rung::rims);
  RankedPose ranked;
  ranked.refined = occ::refine(start, hypothesis.matches, ahead.blobs, ahead.scene, options);
  Result<Refined>& refined = ranked.refined;
  ranked.hypothesis = &hypothesis;
  ranked.unfinished = refined.status == Status::not_converged && refined->iterations > 0;
  if (refined.ok()) {
    refined.message = size_contradiction(*refined, ahead.blobs, ahead.scene);
    if (!refined.message.empty()) refined.status = Status::no_pose;
  }
  ranked.fits = refined.ok() || ranked.unfinished;
  const double prior = options.prior ? options.prior->chi2(refined->cam_from_world) : 0;
  ranked.measured_chi2 = refined->chi2 - prior;
  ranked.assumed_chi2 = prior + ahead.miss_penalty * hypothesis.missed;
  return ranked;
}

std::size_t matches(const RankedPose& pose) { return pose.hypothesis->matches.size(); }

/// Orders by fit, then by the number of matched lamps, then by chi-square. A pose that has not
/// converged ranks by what it has reached; otherwise a worse one could win.
bool better(const RankedPose& a, const RankedPose& b) {
  if (a.fits != b.fits) return a.fits;
  if (matches(a) != matches(b)) return matches(a) > matches(b);
  return a.measured_chi2 + a.assumed_chi2 < b.measured_chi2 + b.assumed_chi2;
}

/// True if a pose is not significantly worse than the best one. A misfit common to all poses (an
/// imperfect lens or map) does not discriminate between them, so differences of measured chi-square
/// count in units of the best pose's misfit.
bool plausible_beside(const RankedPose& best, const RankedPose& pose) {
  const int dof = best.refined->dof;
  const double misfit = dof > 0 ? std::max(1.0, best.measured_chi2 / dof) : 1.0;
  const double worse =
      (pose.measured_chi2 - best.measured_chi2) / misfit + pose.assumed_chi2 - best.assumed_chi2;
  return pose.fits == best.fits && matches(pose) >= matches(best) && worse <= max_pose_delta_chi2;
}

/// Sorts best first. Plausible poses that have not converged continue from where they are.
void rank(const RefinementAhead& ahead, RefineOptions options, std::vector<RankedPose>& poses) {
  constexpr int times_longer = 10;
  options.max_iterations *= times_longer;
  while (true) {
    std::stable_sort(poses.begin(), poses.end(), better);
    const auto next = std::find_if(poses.begin(), poses.end(), [&](const RankedPose& pose) {
      return pose.unfinished && plausible_beside(poses.front(), pose);
    });
    if (next == poses.end()) return;
    *next = refine_hypothesis(ahead, *next->hypothesis, next->refined->cam_from_world, options);
    next->unfinished = false;
  }
}

/// Several assignments can lead to one pose once every rim is used; the best of them remains.
void merge_equal_poses(std::vector<RankedPose>& poses) {
  constexpr double same_pose_chi2 = 1;
  std::vector<RankedPose> distinct;
  for (RankedPose& pose : poses) {
    const bool duplicate =
        std::any_of(distinct.begin(), distinct.end(), [&](const RankedPose& other) {
          const Vector6 delta =
              difference(pose.refined->cam_from_world, other.refined->cam_from_world);
          return delta.dot(core::solve_llt(other.refined->covariance, delta)) < same_pose_chi2;
        });
    if (!duplicate) distinct.push_back(std::move(pose));
  }
  poses = std::move(distinct);
}

/// Chi-square above its expectation.
double excess_chi2(const RankedPose& pose) { return pose.measured_chi2 - pose.refined->dof; }

/// Sets probabilities. If the prior is wrong, a pose as good as the best one may be among those
/// that identification excluded by it, with the probability `excluded`. The shapes of rims are no
/// part of the evidence, which uses centroids and sizes; they tell poses apart by the differences
/// of chi-square, in units of the best pose's misfit (plausible_beside).
void weigh(const RefinementAhead& ahead, Refinement& out) {
  constexpr double excluded = 0.1;
  std::vector<RankedPose>& poses = out.poses;
  const auto best = std::min_element(
      poses.begin(), poses.end(),
      [](const RankedPose& a, const RankedPose& b) { return excess_chi2(a) < excess_chi2(b); });
  const int dof = best->refined->dof;
  const double misfit = dof > 0 ? std::max(1.0, best->measured_chi2 / dof) : 1.0;
  const bool rims = std::any_of(ahead.blobs.begin(), ahead.blobs.end(),
                                [](const Blob& blob) { return !blob.rim.empty(); });
  std::vector<double> evidences;
  double log_none = 0;
  for (RankedPose& pose : poses) {
    const pose::LogEvidence evidence = log_evidence(*pose.refined, *pose.hypothesis, ahead.blobs,
                                                    ahead.scene, ahead.options.prior);
    const double rim_chi2 = rims ? (excess_chi2(pose) - excess_chi2(*best)) / misfit : 0;
    evidences.push_back(evidence.value - 0.5 * rim_chi2);
    log_none = std::max(log_none, std::log(excluded) + evidence.if_prior_wrong - 0.5 * rim_chi2);
  }
  const std::vector<double> shares = pose::probabilities(evidences, log_none);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].probability = shares[i];
  out.none = shares.back();
  std::stable_sort(poses.begin(), poses.end(), [](const RankedPose& a, const RankedPose& b) {
    return a.probability > b.probability;
  });
}

void refine_by_pixels(const RefinementAhead& ahead, const RefineOptions& options,
                      RankedPose& pose) {
  if (!pose.refined.ok()) return;
  Result<Refined> refined = occ::refine(pose.refined->cam_from_world, pose.hypothesis->matches,
                                        ahead.blobs, ahead.scene, options, *ahead.image);
  if (refined.ok()) pose.refined.value = std::move(refined.value);
}

/// Without budget and target the covariance of the best pose is the bound of its observations.
void complete(const Result<Refined>& best, RungChoice& choice) {
  if (choice.predicted_sigma_m || !best.ok()) return;
  const double trace_m2 = position_covariance(best->cam_from_world, best->covariance).trace();
  choice.predicted_sigma_m = std::sqrt(trace_m2 / best->variance_factor);
}

}  // namespace

Refinement refine_hypotheses(const RefinementAhead& ahead,
                             const std::function<double()>& elapsed_s) {
  Refinement out;
  out.choice = rung_for(ahead, elapsed_s);
  RefineOptions options = ahead.options;
  options.rung = out.choice.rung;
  std::vector<RankedPose>& poses = out.poses;
  int refined = 0;
  for (const Hypothesis& hypothesis : ahead.hypotheses) {
    poses.push_back(refine_hypothesis(ahead, hypothesis, hypothesis.cam_from_world, options));
    refined += poses.back().refined.ok();
    if (refined == ahead.max_candidates) break;
  }
  rank(ahead, options, poses);
  const auto remove_if = [&](auto predicate) {
    poses.erase(std::remove_if(poses.begin() + 1, poses.end(), predicate), poses.end());
  };
  remove_if([&](const RankedPose& pose) { return pose.fits != poses.front().fits; });
  merge_equal_poses(poses);
  weigh(ahead, out);
  remove_if([](const RankedPose& pose) { return pose.probability < min_named_probability; });
  if (ahead.image && options.rung == Rung::direct)
    for (RankedPose& pose : poses) refine_by_pixels(ahead, options, pose);
  complete(poses.front().refined, out.choice);
  return out;
}

}  // namespace occ::internal::refine
