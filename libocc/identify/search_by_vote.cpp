// SPDX-License-Identifier: Apache-2.0
// The search where many namings are possible: what explains most blobs is looked for first, so that
// hardly any of the poses voted on has to be looked at closely.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

// Rivals of a strong explanation come from a likeness within the map, and explain the same blobs
// but for an accident: one false light is allowed for.
constexpr int strong_false = 1;

Naming naming_of(const std::vector<Pair>& pairs) { return {pairs[0], pairs[1], pairs[2]}; }

// For every other blob the lamp nearest to it, if within `gate_rad`.
std::vector<Pair> pairs_near(const AssignmentProblem& problem, const Vote& vote) {
  const double gate_rad =
      problem.options->gate_sigma * (2 * problem.options->prior->gravity_sigma_rad + 0.01);
  std::vector<Pair> near;
  for (int s = 0; s < static_cast<int>(problem.sightings.size()); ++s) {
    if (s == vote.naming[0].sighting || s == vote.naming[1].sighting) continue;
    double least = std::cos(gate_rad);
    int target = -1;
    for (int t = 0; t < static_cast<int>(problem.targets.size()); ++t) {
      if (t == vote.naming[0].target || t == vote.naming[1].target || !problem.may_be(s, t))
        continue;
      const Eigen::Vector3d x = vote.pose * problem.target(t).centre;
      const double cosine = problem.sighting(s).bearing.dot(x) / x.norm();
      if (cosine > least) least = cosine, target = t;
    }
    if (target >= 0) near.push_back({s, target});
  }
  return near;
}

}  // namespace

void Search::vote() {
  Ballot ballot(problem_, together_);
  const bool two = named_by_vote() == 2;
  run_poll({ballot.knows_neighbours_only(),
            [&](const std::array<int, 3>& s, int least, std::vector<Vote>& votes) {
              if (two)
                ballot.of_two({s[0], s[1]}, least, votes);
              else
                ballot.of_three(s, least, votes);
            },
            [&]() -> const Turnout& { return ballot.turnout(); }});
}

void Search::run_poll(const Poll& poll) {
  TripleOrder order(problem_, named_by_vote());
  // Where only neighbours are named, those of true lights may be none, as if more lights were
  // false.
  constexpr int max_far_apart = 3;
  if (poll.neighbours_only) order.prefer_neighbours(problem_);
  turnout_.emplace();
  for (int far_apart = poll.neighbours_only ? 1 : 0; !cut_short_; ++far_apart) {
    vote_by_levels(poll, order, far_apart);
    if (!poll.neighbours_only || far_apart == max_far_apart || most_ >= strong) break;
  }
  tried_ = spent();
}

// All explanations of `level` blobs are found once no `blobs - level` false lights can touch all
// groups that were voted on.
void Search::vote_by_levels(const Poll& poll, TripleOrder& order, int far_apart) {
  const int named = named_by_vote(), enough = std::max(prior_ ? 3 : 4, problem_.min_pairs);
  const int blobs = static_cast<int>(problem_.sightings.size());
  std::vector<Vote> votes;
  for (int level = blobs; level >= std::max(enough, most_) && !cut_short_; --level) {
    const auto false_lights = [&] {
      return most_ >= strong ? std::min(blobs - level, strong_false) : blobs - level + far_apart;
    };
    while (const auto group = order.next(false_lights())) {
      poll.cast(group->sightings, enough - named, votes);
      turnout_ = poll.turnout();
      elect(votes, std::max(std::min(level, strong), most_) - named);
      if (cut_short_) break;
    }
    elect(votes, std::max(level, most_) - named);
  }
}

// Blobs of a group: two where gravity is known.
int Search::named_by_vote() const {
  if (by_shape_ || problem_.options->method == IdentifyMethod::clustering) return 3;
  return prior_ && problem_.options->prior->gravity_in_cam ? 2 : 3;
}

// Looks at those that may explain enough, most first, and takes them off the list.
void Search::elect(std::vector<Vote>& votes, int least) {
  const auto rest = std::stable_partition(votes.begin(), votes.end(),
                                          [&](const Vote& v) { return v.further >= least; });
  std::stable_sort(votes.begin(), rest,
                   [](const Vote& a, const Vote& b) { return a.further > b.further; });
  for (auto vote = votes.begin(); vote != rest && !cut_short_; ++vote)
    if (vote->further + static_cast<int>(vote->naming.size()) >= most_ && !known(*vote)) {
      consider(*vote);
      cut_short_ = spent() >= problem_.options->max_hypotheses;
    }
  cut_short_ = spent() >= problem_.options->max_hypotheses;
  votes.erase(votes.begin(), rest);
}

// Namings voted on; a close look takes as long as a number of them.
int Search::spent() const {
  constexpr int as_long_as = 30;
  return turnout_->namings + as_long_as * looks_;
}

// Another way to a pose that has been found.
bool Search::known(const Vote& vote) const {
  constexpr double same_turn = 0.05;
  return std::any_of(found_.begin(), found_.end(), [&](const PoseHypothesis& e) {
    return std::all_of(vote.naming.begin(), vote.naming.end(),
                       [&](const Pair& p) { return contains(e.pairs, p); }) &&
           (vote.pose.rotation - e.estimate.pose.rotation).norm() < same_turn;
  });
}

void Search::consider(const Vote& vote) {
  const auto try_three = [&](const std::vector<Pair>& three) {
    looks_ += 1;
    const Naming naming = naming_of(three);
    const FittedPose seed = fit_pose(problem_, three, vote.pose);
    const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
    if (seed.chi2 <= gate2 && looks_right(problem_, naming, seed.pose)) consider(seed, naming);
  };
  if (vote.naming.size() == 3) {
    try_three(vote.naming);
    return;
  }
  for (const Pair& third : pairs_near(problem_, vote)) {
    if (std::any_of(found_.begin(), found_.end(), [&](const PoseHypothesis& e) {
          return contains(e.pairs, third) && contains(e.pairs, vote.naming[0]) &&
                 contains(e.pairs, vote.naming[1]);
        }))
      continue;
    std::vector<Pair> three = vote.naming;
    three.push_back(third);
    try_three(three);
  }
}

// Whether the lamps that should be seen but are not speak louder against a pose than its pairs,
// beyond those that determine it, speak for it: each of these would be in its gate by an accident
// as likely as the gate's share of the image.
bool Search::misses_too_much(const PoseHypothesis& e) const {
  const double by_accident = gate_share(problem_);
  const int beyond = static_cast<int>(e.pairs.size()) - named_by_vote();
  return 0.5 * problem_.options->miss_penalty * e.missed > -std::log(by_accident) * (beyond + 1);
}

// Pairs by accident are anywhere in their gates; the truth fits worse in one case of a thousand.
bool Search::fits(const PoseHypothesis& e) const {
  const int known = prior_ ? problem_.options->prior->dof() : 0;
  return variance_factor(e.estimate.chi2, 2 * static_cast<int>(e.pairs.size()) - 6 + known) == 1;
}

// Poisson: each pose voted on meets a further blob by the share of the image that its gate covers,
// once for each lamp that is in view from there. From a pose that misses many lamps many are.
double Search::chance_of(const PoseHypothesis& e) const {
  constexpr double gate_of_few = 5;  // typically, over that of a firm pose
  if (!(turnout_->poses > 0)) return 0;
  const int size = static_cast<int>(e.pairs.size()), named = named_by_vote();
  const double in_view =
      std::max(turnout_->visible / turnout_->poses, static_cast<double>(size + e.missed - named));
  const double share = gate_share(problem_);
  double expected = turnout_->poses * gate_of_few;
  for (int pairs = named; pairs < size; ++pairs)
    expected *= std::max(in_view - (pairs - named), 0.0) *
                static_cast<double>(static_cast<int>(problem_.sightings.size()) - pairs) * share /
                (pairs - named + 1);
  return expected;
}

}  // namespace occ::internal::identify
