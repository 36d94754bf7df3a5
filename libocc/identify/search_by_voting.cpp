// SPDX-License-Identifier: Apache-2.0
// Search by voting, for maps with many possible assignments. Candidate poses are scored first and
// verified in the order of their scores, so that only a few are verified.
//
// Hashing scores only triangles of blobs whose shape occurs in the map, as star trackers do with
// triples of stars (Liebe, "Star trackers for attitude determination", IEEE AES Magazine 10, 1995;
// Lamdan, Wolfson, "Geometric hashing", ICCV 1988). Gravity must be known and the lamps must hang
// at one height: a perspective image of unknown tilt has no invariant of three or four coplanar
// points.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "libocc/core/statistics.hpp"
#include "libocc/identify/internal/search.hpp"
#include "libocc/identify/internal/shape_voting.hpp"
#include "libocc/identify/lamp_index.hpp"

namespace occ::internal::identify {
namespace {

// Rivals of a strong hypothesis result from symmetries of the map. They match the same blobs except
// for accidents, so one outlier is assumed.
constexpr int max_outliers_if_strong = 1;

Assignment to_assignment(const std::vector<Pair>& pairs) { return {pairs[0], pairs[1], pairs[2]}; }

// Returns for every remaining blob the lamp nearest to it, if within the gate.
std::vector<Pair> pairs_near(const AssignmentProblem& problem, const ScoredPose& candidate) {
  const double gate_rad =
      problem.options->gate_sigma * (2 * problem.options->prior->gravity_sigma_rad + 0.01);
  std::vector<Pair> near;
  for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
    if (s == candidate.assignment[0].observation || s == candidate.assignment[1].observation)
      continue;
    double max_cosine = std::cos(gate_rad);
    int map_point = -1;
    for (int t = 0; t < static_cast<int>(problem.map_points.size()); ++t) {
      if (t == candidate.assignment[0].map_point || t == candidate.assignment[1].map_point ||
          !problem.allows(s, t))
        continue;
      const Eigen::Vector3d x = candidate.pose * problem.map_point(t).centre;
      const double cosine = problem.observation(s).bearing.dot(x) / x.norm();
      if (cosine > max_cosine) max_cosine = cosine, map_point = t;
    }
    if (map_point >= 0) near.push_back({s, map_point});
  }
  return near;
}

}  // namespace

void WaitingPoses::add(std::vector<ScoredPose>& scored) {
  for (ScoredPose& pose : scored) {
    const auto inliers = static_cast<std::size_t>(std::max(pose.inliers, 0));
    if (by_inliers_.size() <= inliers) by_inliers_.resize(inliers + 1);
    by_inliers_[inliers].push_back(std::move(pose));
  }
  scored.clear();
}

std::vector<ScoredPose> WaitingPoses::take(int min_inliers) {
  std::vector<ScoredPose> taken;
  const auto from = static_cast<std::size_t>(std::max(min_inliers, 0));
  for (std::size_t inliers = by_inliers_.size(); inliers-- > from;) {
    std::move(by_inliers_[inliers].begin(), by_inliers_[inliers].end(), std::back_inserter(taken));
    by_inliers_[inliers].clear();
  }
  return taken;
}

void Search::search_by_voting() {
  HypothesisVoting voting(problem_, covisibility_, sizes_);
  const bool two = group_size() == 2;
  run_voting(
      {voting.neighbours_truncated(),
       [&](const std::array<int, 3>& s, int min_inliers, std::vector<ScoredPose>& candidates) {
         if (two)
           voting.score_pairs({s[0], s[1]}, min_inliers, candidates);
         else
           voting.score_triples(s, min_inliers, candidates);
       },
       [&]() -> const VoteStatistics& { return voting.statistics(); }});
}

void Search::search_by_hashing() {
  if (!problem_.scene || !prior_ || !problem_.options->prior->gravity_in_cam) {
    search_by_voting();
    return;
  }
  const LampIndex index =
      problem_.options->index ? *problem_.options->index : LampIndex(problem_.scene->lamps);
  if (!index.applies()) {
    search_by_voting();
    return;
  }
  by_shape_ = true;
  ShapeVoting voting(problem_, index.table());
  run_voting(
      {voting.neighbours_truncated(),
       [&](const std::array<int, 3>& s, int min_inliers, std::vector<ScoredPose>& candidates) {
         voting.score_triples(s, min_inliers, candidates);
       },
       [&]() -> const VoteStatistics& { return voting.statistics(); }});
}

void Search::run_voting(const VotingMethod& method) {
  TripleOrder order(problem_, group_size());
  // If only neighbouring lamps are combined, groups of true but distant lights yield no pose, as if
  // more blobs were outliers.
  constexpr int max_distant_outliers = 3;
  if (method.neighbours_truncated) order.prefer_neighbours(problem_);
  statistics_.emplace();
  groups_in_all_ = order.groups();
  for (int distant_outliers = method.neighbours_truncated ? 1 : 0; !cut_short_;
       ++distant_outliers) {
    vote_by_levels(method, order, distant_outliers);
    if (!method.neighbours_truncated || distant_outliers == max_distant_outliers ||
        best_is_strong())
      break;
  }
  tried_ = cost();
}

// Searches from the largest number of pairs, the level, downwards. A level is complete when, for
// each possible set of `blobs - level` outliers, a group without any of them has been scored.
void Search::vote_by_levels(const VotingMethod& method, TripleOrder& order, int distant_outliers) {
  const int group = group_size(), enough = std::max(prior_ ? 3 : 4, problem_.min_pairs);
  const int blobs = static_cast<int>(problem_.observations.size());
  std::vector<ScoredPose> scored;
  WaitingPoses candidates;  // most poses wait for a level that is never reached
  for (int level = blobs; level >= std::max(enough, best_support_ - fewer_pairs()) && !cut_short_;
       --level) {
    const auto max_outliers = [&] {
      return best_is_strong() ? std::min(blobs - level, max_outliers_if_strong)
                              : blobs - level + distant_outliers;
    };
    while (const auto triple = order.next(max_outliers())) {
      if (enough_groups(groups_++)) return;
      method.score(triple->observations, enough - group, scored);
      candidates.add(scored);
      statistics_ = method.statistics();
      verify_best(candidates,
                  std::max(std::min(level, strong_pairs), best_support_ - fewer_pairs()) - group);
      if (cut_short_) {
        --groups_;  // not complete
        break;
      }
    }
    verify_best(candidates, std::max(level, best_support_ - fewer_pairs()) - group);
  }
}

// True if a pose with nearly as many pairs as a hypothesis of many pairs would have been found with
// a probability of 1 - 1e-5: one of the groups scored consists of its blobs only. The groups count
// as random.
bool Search::enough_groups(int groups) const {
  constexpr double max_overlooked = 1e-5;
  if (best_support_ < strong_pairs) return false;
  const double share = static_cast<double>(best_support_ - fewer_pairs()) /
                       static_cast<double>(problem_.observations.size());
  const double all_right = std::pow(std::min(1.0, share), group_size());
  return groups * std::log1p(-std::min(all_right, 0.999)) < std::log(max_overlooked);
}

// Number of blobs in a group: two if gravity or a last pose is known.
int Search::group_size() const {
  if (by_last_pose_) return 2;
  if (by_shape_ || problem_.options->method == IdentifyMethod::clustering) return 3;
  return prior_ && problem_.options->prior->gravity_in_cam ? 2 : 3;
}

// Verifies the candidates with enough inliers, best first, and removes them from the list.
void Search::verify_best(WaitingPoses& candidates, int min_inliers) {
  for (const ScoredPose& candidate : candidates.take(min_inliers)) {
    if (cut_short_) break;
    if (candidate.inliers + static_cast<int>(candidate.assignment.size()) <
            best_support_ - fewer_pairs() ||
        is_duplicate(candidate))
      continue;
    consider(candidate);
    cut_short_ = reached_limit();
  }
  cut_short_ = reached_limit();
}

bool Search::reached_limit() const {
  return cost() >= problem_.options->max_hypotheses || problem_.out_of_time();
}

// Cost of the search in assignments scored.
int Search::cost() const {
  constexpr int cost_of_verification = 30;  // of one candidate, in assignments scored
  return statistics_->assignments + cost_of_verification * verified_;
}

// True if a hypothesis found contains the assignment and has nearly the same rotation.
bool Search::is_duplicate(const ScoredPose& candidate) const {
  constexpr double same_rotation = 0.05;
  return std::any_of(found_.begin(), found_.end(), [&](const PoseHypothesis& e) {
    return std::all_of(candidate.assignment.begin(), candidate.assignment.end(),
                       [&](const Pair& p) { return contains(e.pairs, p); }) &&
           (candidate.pose.rotation - e.estimate.pose.rotation).norm() < same_rotation;
  });
}

void Search::consider(const ScoredPose& candidate) {
  const auto try_three = [&](const std::vector<Pair>& three) {
    verified_ += 1;
    const Assignment assignment = to_assignment(three);
    const FittedPose seed = fit_pose(problem_, three, candidate.pose);
    const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
    if (seed.chi2 <= gate2 && appearance_agrees(problem_, assignment, seed.pose))
      consider(seed, assignment);
  };
  if (candidate.assignment.size() == 3) {
    try_three(candidate.assignment);
    return;
  }
  for (const Pair& third : pairs_near(problem_, candidate)) {
    if (std::any_of(found_.begin(), found_.end(), [&](const PoseHypothesis& e) {
          return contains(e.pairs, third) && contains(e.pairs, candidate.assignment[0]) &&
                 contains(e.pairs, candidate.assignment[1]);
        }))
      continue;
    std::vector<Pair> three = candidate.assignment;
    three.push_back(third);
    try_three(three);
  }
}

// Compares the penalty of the missed lamps with the evidence of the pairs beyond those that
// determine the pose: each of these would be inside its gate by chance with a probability of the
// gate's image share.
bool Search::misses_too_many(const PoseHypothesis& e) const {
  const double probability = gate_share(problem_);
  const int beyond = static_cast<int>(e.pairs.size()) - group_size();
  return 0.5 * problem_.options->miss_penalty * e.missed > -std::log(probability) * (beyond + 1);
}

// Tests chi-square against its 99.9 % quantile. Accidental pairs are uniformly distributed in their
// gates, so their chi-square is larger.
bool Search::fits(const PoseHypothesis& e) const {
  const int prior_dof = prior_ ? problem_.options->prior->dof() : 0;
  return variance_factor(e.estimate.chi2, 2 * static_cast<int>(e.pairs.size()) - 6 + prior_dof) ==
         1;
}

// Expected number of wrong hypotheses by a Poisson model: for each pose scored until it was found
// (the search for its rivals scores more), each further blob
// matches a lamp in view with the probability of the gate's image share. A pose that misses many
// lamps has many lamps in view.
double Search::chance_of(const PoseHypothesis& e) const {
  constexpr double gate_of_few = 5;  // typical area of a gate, relative to a well-determined pose
  if (!(statistics_->poses > 0)) return 0;
  const double poses = e.poses_scored > 0 ? e.poses_scored : statistics_->poses;
  const int size = static_cast<int>(e.pairs.size()), group = group_size();
  const double in_view = std::max(statistics_->visible / statistics_->poses,
                                  static_cast<double>(size + e.missed - group));
  const double share = gate_share(problem_);
  double expected = poses * gate_of_few;
  for (int pairs = group; pairs < size; ++pairs)
    expected *= std::max(in_view - (pairs - group), 0.0) *
                static_cast<double>(static_cast<int>(problem_.observations.size()) - pairs) *
                share / (pairs - group + 1);
  return expected;
}

}  // namespace occ::internal::identify
