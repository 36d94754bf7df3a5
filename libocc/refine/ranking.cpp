// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/ranking.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/verdict.hpp"
#include "libocc/pose/internal/evidence.hpp"
#include "libocc/refine/internal/estimated_map.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"
#include "libocc/refine/internal/pose_roots.hpp"

namespace occ::internal::refine {
namespace {

/// A pose that has not converged is a rival from this probability on.
constexpr double min_unfinished = 0.01;

/// Two poses meet at a degenerate minimum. It does not determine the pose, but may be the right
/// one. There are other degenerate minima where the lamps contradict each other, such as that of a
/// camera in the plane of the lamps.
bool is_meeting_of_poses(const Result<Refined>& refined) {
  constexpr double max_px = 5;
  return refined.status == Status::degenerate && refined->iterations > 0 &&
         std::all_of(refined->lamps.begin(), refined->lamps.end(), [](const LampResidual& lamp) {
           return !lamp.contradicts && lamp.rms_px < max_px;
         });
}

/// The visible part of a lamp that the image border cuts may be hidden in part, too, or belong to
/// another lamp: fits the pose without the rims of such lamps, which then contradict it. Replaces
/// `refined` if that succeeds.
void refine_without_cut_rims(const RefinementAhead& ahead, const std::vector<Match>& matches,
                             const Rigid3& start, const RefineOptions& options,
                             Result<Refined>& refined) {
  std::vector<Blob> blobs = ahead.blobs;
  std::vector<char> is_left_out(blobs.size(), 0);
  for (const Match& match : matches) {
    const auto i = static_cast<std::size_t>(match.blob);
    if (!blobs[i].cut_by_border || blobs[i].corners_px.empty()) continue;
    blobs[i].rim.clear();
    is_left_out[i] = 1;
  }
  if (std::count(is_left_out.begin(), is_left_out.end(), 1) == 0) return;
  Result<Refined> without = refine_as_stated(start, matches, blobs, ahead.scene, options, nullptr);
  if (!without.ok() || (refined.ok() && !(without->variance_factor < refined->variance_factor)))
    return;
  refined = std::move(without);
  for (LampResidual& lamp : refined.value.lamps)
    if (is_left_out[static_cast<std::size_t>(lamp.match.blob)]) lamp.contradicts = true;
}

RankedPose refine_hypothesis(const RefinementAhead& ahead, const Hypothesis& hypothesis,
                             const Rigid3& start, const RefineOptions& given) {
  constexpr int times_longer = 5;     // fewer than three lamps have narrow, curved valleys
  constexpr double max_factor = 100;  // errors of the map give less
  RefineOptions options = given;
  options.rung = std::min(options.rung, Rung::rims);
  if (hypothesis.matches.size() < 3) options.max_iterations *= times_longer;
  RankedPose ranked;
  ranked.refined =
      refine_as_stated(start, hypothesis.matches, ahead.blobs, ahead.scene, options, nullptr);
  Result<Refined>& refined = ranked.refined;
  if (!refined.ok() || refined->variance_factor > max_factor)
    refine_without_cut_rims(ahead, hypothesis.matches, start, options, refined);
  ranked.hypothesis = &hypothesis;
  ranked.unfinished = refined.status == Status::not_converged && refined->iterations > 0;
  if (refined.ok()) {
    refined.message = size_contradiction(*refined, ahead.blobs, ahead.scene);
    if (!refined.message.empty()) refined.status = Status::no_pose;
  }
  ranked.fits = refined.ok() || ranked.unfinished || is_meeting_of_poses(refined);
  ranked.chi2 = refined->chi2 + ahead.identify.miss_penalty * hypothesis.missed;
  return ranked;
}

/// If the sizes contradict all poses: fits each pose again with estimated errors of the sizes.
void allow_wrong_sizes(const RefinementAhead& ahead, const RefineOptions& options,
                       std::vector<RankedPose>& poses) {
  if (std::any_of(poses.begin(), poses.end(), [](const RankedPose& pose) { return pose.fits; }))
    return;
  for (RankedPose& pose : poses) {
    if (pose.refined.status != Status::no_pose) continue;
    auto sized = with_estimated_sizes(*pose.refined, pose.hypothesis->matches, ahead.blobs,
                                      ahead.scene, options);
    if (!sized || !size_contradiction(*sized, ahead.blobs, ahead.scene).empty()) continue;
    pose.refined.value = *std::move(sized);
    pose.refined.status = Status::ok;
    pose.refined.message.clear();
    pose.fits = true;
  }
}

std::size_t matches(const RankedPose& pose) { return pose.hypothesis->matches.size(); }

/// Orders by fit, then by the number of matched lamps, then by chi-square.
bool better(const RankedPose& a, const RankedPose& b) {
  if (a.fits != b.fits) return a.fits;
  if (matches(a) != matches(b)) return matches(a) > matches(b);
  // Two equal discs that are exchanged have the same chi2: such poses keep their order.
  const auto rounded = [](double chi2) { return std::round(1e3 * chi2); };
  return rounded(a.chi2) < rounded(b.chi2);
}

/// True if the matches of a pose are some of those of another.
bool has_some_matches_of(const RankedPose& pose, const RankedPose& other) {
  const auto is_matched = [&](const Match& match) {
    return std::any_of(
        other.hypothesis->matches.begin(), other.hypothesis->matches.end(),
        [&](const Match& m) { return m.lamp == match.lamp && m.blob == match.blob; });
  };
  return matches(pose) < matches(other) &&
         std::all_of(pose.hypothesis->matches.begin(), pose.hypothesis->matches.end(), is_matched);
}

/// Several assignments can lead to one pose once every rim is used; the best of them remains. One
/// of fewer lamps leads to it within its own errors.
void merge_equal_poses(std::vector<RankedPose>& poses) {
  constexpr double same_pose_chi2 = 1, max_chi2_of_some = 20;
  std::vector<RankedPose> distinct;
  for (RankedPose& pose : poses) {
    const bool duplicate =
        std::any_of(distinct.begin(), distinct.end(), [&](const RankedPose& other) {
          const Vector6 delta =
              difference(pose.refined->cam_from_world, other.refined->cam_from_world);
          const auto sigmas2 = [&](const RankedPose& of) {
            return delta.dot(core::solve_llt(of.refined->covariance, delta));
          };
          return sigmas2(other) < same_pose_chi2 ||
                 (pose.refined.ok() && other.refined.ok() && has_some_matches_of(pose, other) &&
                  sigmas2(pose) < max_chi2_of_some);
        });
    if (!duplicate) distinct.push_back(std::move(pose));
  }
  poses = std::move(distinct);
}

/// Independent numbers in a rim with common errors: its shape, or one side of a lamp that is hidden
/// in part.
double independent_numbers(const Blob& blob) { return blob.hidden_in_part ? 1 : 3; }

/// ln of the likelihood of the rims, up to a constant. Their errors of unknown size are common to
/// the points of a rim, so a rim counts as a few numbers with an error of its residual's size; a
/// lamp without a rim as an error of one pixel. A pose that was not fitted to
/// the rims leaves errors of its own, which are common to all rims; there only the shapes count.
/// `incomparable`: blobs that do not count.
double log_rims(const RankedPose& pose, const std::vector<Blob>& blobs,
                const std::set<int>& incomparable) {
  constexpr double min_px = 0.02;
  double sum = 0;
  for (const LampResidual& lamp : pose.refined->lamps)
    if (!lamp.contradicts && lamp.rung >= Rung::rims && incomparable.count(lamp.match.blob) == 0)
      sum -= independent_numbers(blobs[lamp.match.blob]) * std::log(std::max(min_px, lamp.rms_px));
  return sum;
}

/// Blobs with a rim that some pose does not use, because over-exposed rims did not converge there.
/// The rim is then no evidence for the other poses.
std::set<int> blobs_with_unused_rims(const std::vector<RankedPose>& poses,
                                     const std::vector<Blob>& blobs) {
  std::set<int> unused;
  for (const RankedPose& pose : poses)
    for (const LampResidual& lamp : pose.refined->lamps)
      if (!lamp.contradicts && lamp.rung < Rung::rims && blobs[lamp.match.blob].saturated &&
          !blobs[lamp.match.blob].rim.empty())
        unused.insert(lamp.match.blob);
  return unused;
}

/// True if both poses have the same lamps for their blobs, apart from partial blobs.
bool same_assignment(const RankedPose& a, const RankedPose& b, const std::vector<Blob>& blobs) {
  const auto used = [&](const RankedPose& pose) {
    std::vector<std::pair<int, int>> pairs;
    for (const LampResidual& lamp : pose.refined->lamps)
      if (!lamp.contradicts && is_whole(blobs[lamp.match.blob]))
        pairs.emplace_back(lamp.match.lamp, lamp.match.blob);
    return pairs;
  };
  return used(a) == used(b);
}

/// Evidence of each pose. Poses of one assignment are compared as a group.
std::vector<pose::LogEvidence> evidence_of_places(const RefinementAhead& ahead,
                                                  const std::vector<RankedPose>& poses) {
  std::vector<pose::LogEvidence> all(poses.size());
  std::vector<char> done(poses.size(), 0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::vector<std::size_t> members;
    std::vector<pose::PoseEvidence> group;
    for (std::size_t k = i; k < poses.size(); ++k) {
      if (done[k] || !same_assignment(poses[i], poses[k], ahead.blobs)) continue;
      done[k] = 1;
      members.push_back(k);
      group.push_back(evidence_of(*poses[k].refined, *poses[k].hypothesis, ahead.blobs, ahead.scene,
                                  ahead.options.prior));
    }
    const std::vector<pose::LogEvidence> logs = pose::log_evidences(group);
    for (std::size_t k = 0; k < members.size(); ++k) all[members[k]] = logs[k];
  }
  return all;
}

/// Sets probabilities. Rims tell the poses apart; as evidence against false lights they count by
/// their centres and sizes only. If a part of the prior is wrong, a pose as good as the best one
/// may be among those that identification excluded without listing it, with the probability
/// excluded_by_prior.
void weigh(const RefinementAhead& ahead, Refinement& out) {
  std::vector<RankedPose>& poses = out.poses;
  double best_rims = -infinity;
  const std::set<int> incomparable = blobs_with_unused_rims(poses, ahead.blobs);
  for (const RankedPose& pose : poses)
    best_rims = std::max(best_rims, log_rims(pose, ahead.blobs, incomparable));
  std::vector<double> evidences;
  double log_none = 0;
  const std::vector<pose::LogEvidence> places = evidence_of_places(ahead, poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double rims = log_rims(poses[i], ahead.blobs, incomparable) - best_rims;
    evidences.push_back(places[i].value + rims);
    log_none = std::max(log_none, std::log(identify::excluded_by_prior) +
                                      places[i].if_excluded(ahead.excluded_listed) + rims);
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
  Result<Refined> refined = refine_as_stated(pose.refined->cam_from_world, pose.hypothesis->matches,
                                             ahead.blobs, ahead.scene, options, ahead.image);
  if (refined.ok()) pose.refined.value = std::move(refined.value);
}

/// Appends the other poses of each assignment that was refined: identification keeps one pose
/// within its coarse errors. A pose that leads to a known one is merged with it later.
void add_other_roots(const RefinementAhead& ahead, const RefineOptions& options, Refinement& out) {
  std::optional<identify::AssignmentProblem> problem;
  const std::size_t known = out.poses.size();
  for (std::size_t i = 0; i < known; ++i) {
    if (!out.poses[i].fits) continue;
    for (const Rigid3& root : other_roots(*out.poses[i].refined, ahead.blobs, ahead.scene)) {
      if (!problem) problem = identify::make_problem(ahead.blobs, ahead.scene, ahead.identify);
      const std::vector<Match>& matches = out.poses[i].hypothesis->matches;
      auto hypothesis = identify::hypothesis_at(*problem, matches, root);
      if (!hypothesis) continue;
      out.roots.push_back(*std::move(hypothesis));
      out.poses.push_back(refine_hypothesis(ahead, out.roots.back(), root, options));
    }
  }
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
  allow_wrong_sizes(ahead, options, poses);
  add_other_roots(ahead, options, out);
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
  for (RankedPose& pose : poses)
    pose.refined = with_estimated_map(pose.refined, pose.hypothesis->matches, ahead.blobs,
                                      ahead.scene, options);
  complete(poses.front().refined, out.choice);
  return out;
}

}  // namespace occ::internal::refine
