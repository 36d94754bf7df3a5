// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/ranking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"

namespace occ::internal::refine {
namespace {

/// A pose that has not converged is a rival from this probability on.
constexpr double min_unfinished = 0.01;

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

/// Orders by fit, then by the number of matched lamps, then by chi-square.
bool better(const RankedPose& a, const RankedPose& b) {
  if (a.fits != b.fits) return a.fits;
  if (matches(a) != matches(b)) return matches(a) > matches(b);
  return a.measured_chi2 + a.assumed_chi2 < b.measured_chi2 + b.assumed_chi2;
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

/// ln of the likelihood of the rims, up to a constant. Their errors of unknown size are common to
/// the points of a rim, so a rim counts as three numbers (its shape) with an error of its
/// residual's size; a lamp without a rim as an error of one pixel.
double log_rims(const RankedPose& pose, const std::vector<Blob>& blobs) {
  constexpr double numbers = 3, min_px = 0.02;
  double sum = 0;
  for (const LampResidual& lamp : pose.refined->lamps)
    if (!lamp.contradicts && !blobs[lamp.match.blob].rim.empty())
      sum -= numbers * std::log(std::max(min_px, lamp.rms_px));
  return sum;
}

/// Sets probabilities. Rims tell the poses apart; as evidence against false lights they count by
/// their centres and sizes only. If a part of the prior is wrong, a pose as good as the best one
/// may be among those that identification excluded, with the probability `excluded`.
void weigh(const RefinementAhead& ahead, Refinement& out) {
  constexpr double excluded = 0.1;
  std::vector<RankedPose>& poses = out.poses;
  double best_rims = -infinity;
  for (const RankedPose& pose : poses) best_rims = std::max(best_rims, log_rims(pose, ahead.blobs));
  std::vector<double> evidences;
  double log_none = 0;
  for (const RankedPose& pose : poses) {
    const pose::LogEvidence evidence = log_evidence(*pose.refined, *pose.hypothesis, ahead.blobs,
                                                    ahead.scene, ahead.options.prior);
    const double rims = log_rims(pose, ahead.blobs) - best_rims;
    evidences.push_back(evidence.value + rims);
    log_none = std::max(log_none, std::log(excluded) + evidence.if_prior_wrong + rims);
  }
  const std::vector<double> shares = pose::probabilities(evidences, log_none);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].probability = shares[i];
  out.none = shares.back();
  const auto rounded = [](const RankedPose& pose) {  // equal poses keep their order
    return std::round(20 * std::log(std::max(pose.probability, 1e-300)));
  };
  std::stable_sort(poses.begin(), poses.end(), [&](const RankedPose& a, const RankedPose& b) {
    return rounded(a) > rounded(b);
  });
}

/// Weighs the poses. Those that have not converged, but are rivals by what they have reached,
/// continue from where they are.
void weigh_to_the_end(const RefinementAhead& ahead, RefineOptions options, Refinement& out) {
  constexpr int times_longer = 10;
  options.max_iterations *= times_longer;
  while (true) {
    merge_equal_poses(out.poses);
    weigh(ahead, out);
    const auto next = std::find_if(out.poses.begin(), out.poses.end(), [](const RankedPose& pose) {
      return pose.unfinished && pose.probability >= min_unfinished;
    });
    if (next == out.poses.end()) return;
    *next = refine_hypothesis(ahead, *next->hypothesis, next->refined->cam_from_world, options);
    next->unfinished = false;
  }
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
  std::stable_sort(poses.begin(), poses.end(), better);
  const auto remove_if = [&](auto predicate) {
    poses.erase(std::remove_if(poses.begin() + 1, poses.end(), predicate), poses.end());
  };
  remove_if([&](const RankedPose& pose) { return pose.fits != poses.front().fits; });
  weigh_to_the_end(ahead, options, out);
  remove_if([](const RankedPose& pose) {
    return pose.probability < (pose.refined.ok() ? min_named_probability : min_unfinished);
  });
  if (ahead.image && options.rung == Rung::direct)
    for (RankedPose& pose : poses) refine_by_pixels(ahead, options, pose);
  complete(poses.front().refined, out.choice);
  return out;
}

}  // namespace occ::internal::refine
