// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/identify/internal/assignment_evidence.hpp"
#include "libocc/identify/internal/brightness.hpp"

namespace occ::internal::identify {
namespace {

PoseHypothesis with_pose(const AssignmentProblem& problem, const Hypothesis& hypothesis) {
  const Rigid3& from_world = hypothesis.cam_from_world;
  PoseHypothesis e;
  e.pairs = pairs_of(problem, hypothesis);
  e.estimate = assess_pose(problem, e.pairs, {from_world.rotation, from_world * problem.origin});
  e.chi2 = hypothesis.chi2;
  e.missed = hypothesis.missed;
  return e;
}

std::vector<PoseHypothesis> with_poses(const AssignmentProblem& problem,
                                       const std::vector<Hypothesis>& hypotheses) {
  std::vector<PoseHypothesis> all;
  for (const Hypothesis& hypothesis : hypotheses) all.push_back(with_pose(problem, hypothesis));
  return all;
}

/// The powers in the map are right if a hypothesis with the most pairs agrees with them.
bool powers_fit(const AssignmentProblem& problem, const std::vector<PoseHypothesis>& all) {
  std::size_t most = 0;
  for (const PoseHypothesis& e : all) most = std::max(most, e.pairs.size());
  return std::any_of(all.begin(), all.end(), [&](const PoseHypothesis& e) {
    return e.pairs.size() == most && brightness_of(problem, e).fits;
  });
}

/// Poses of one assignment share the density of the pose before places are compared.
std::vector<pose::LogEvidence> evidences_of(const AssignmentProblem& problem,
                                            const std::vector<PoseHypothesis>& all) {
  const bool fit = powers_fit(problem, all);
  std::vector<pose::LogEvidence> evidences(all.size());
  std::vector<char> done(all.size(), 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<std::size_t> members;
    std::vector<pose::PoseEvidence> group;
    for (std::size_t k = i; k < all.size(); ++k) {
      if (done[k] || !same_pairs(all[i].pairs, all[k].pairs)) continue;
      done[k] = 1;
      members.push_back(k);
      group.push_back(evidence_of(problem, all[k], problem.options->prior, fit));
    }
    const std::vector<pose::LogEvidence> logs = pose::log_evidences(group);
    for (std::size_t k = 0; k < members.size(); ++k) evidences[members[k]] = logs[k];
  }
  return evidences;
}

bool is_same_pose(const PoseHypothesis& a, const PoseHypothesis& b) {
  constexpr double max_chi2 = 1;
  const auto near = [](const FittedPose& from, const FittedPose& to) {
    const Vector6 delta = difference(to.pose, from.pose);
    return delta.dot(core::solve_llt(from.covariance, delta)) < max_chi2;
  };
  return near(a.estimate, b.estimate) && near(b.estimate, a.estimate);
}

struct Weighed {
  Hypothesis hypothesis;
  PoseHypothesis pose;
};

/// Sorts by probability; equal poses keep their order. A pose that several assignments lead to has
/// the sum of their probabilities.
void sort_and_merge(std::vector<Weighed>& all) {
  const auto rounded = [](const Weighed& w) {
    return std::round(20 * std::log(std::max(w.hypothesis.probability, 1e-300)));
  };
  std::stable_sort(all.begin(), all.end(),
                   [&](const Weighed& a, const Weighed& b) { return rounded(a) > rounded(b); });
  std::vector<Weighed> distinct;
  for (Weighed& w : all) {
    const auto same = std::find_if(distinct.begin(), distinct.end(),
                                   [&](const Weighed& d) { return is_same_pose(d.pose, w.pose); });
    if (same == distinct.end())
      distinct.push_back(std::move(w));
    else
      same->hypothesis.probability += w.hypothesis.probability;
  }
  all = std::move(distinct);
}

/// Probability of each pose that only the prior excludes, over that of the best hypothesis.
std::vector<double> excluded_shares(const AssignmentProblem& problem, const PoseHypothesis& best,
                                    const std::vector<Hypothesis>& excluded) {
  if (excluded.empty()) return {};
  std::vector<PoseHypothesis> all = with_poses(problem, excluded);
  all.push_back(best);
  const bool fit = powers_fit(problem, all);
  std::vector<double> shares;
  for (std::size_t i = 0; i < excluded.size(); ++i) {
    const auto log_ratio = [&](const std::optional<Prior>& prior) {
      const auto log_of = [&](const PoseHypothesis& e) {
        return pose::log_evidence(evidence_of(problem, e, prior, fit)).value;
      };
      return log_of(all[i]) - log_of(best);
    };
    shares.push_back(
        share_of_excluded(*problem.options->prior, excluded[i].cam_from_world, log_ratio));
  }
  return shares;
}

/// Sets the probabilities of hypotheses and excluded poses; returns that of none of them.
double weigh(const AssignmentProblem& problem, Identification& found) {
  std::vector<Weighed> all;
  for (const Hypothesis& h : found.hypotheses) all.push_back({h, with_pose(problem, h)});
  const std::vector<pose::LogEvidence> logs =
      evidences_of(problem, with_poses(problem, found.hypotheses));
  std::vector<double> values;
  double log_none = 0;
  for (const pose::LogEvidence& log : logs) {
    values.push_back(log.value);
    log_none =
        std::max(log_none, std::log(excluded_by_prior) + log.if_excluded(found.excluded_listed));
  }
  const std::vector<double> shares = pose::probabilities(values, log_none);
  for (std::size_t i = 0; i < all.size(); ++i) all[i].hypothesis.probability = shares[i];
  sort_and_merge(all);

  const Weighed& best = all.front();
  const std::vector<double> excluded = excluded_shares(problem, best.pose, found.excluded);
  double sum = 1;
  for (std::size_t i = 0; i < excluded.size(); ++i)
    sum += found.excluded[i].probability = best.hypothesis.probability * excluded[i];
  for (Hypothesis& h : found.excluded) h.probability /= sum;

  found.hypotheses.clear();
  for (const Weighed& w : all) {
    Hypothesis h = w.hypothesis;
    h.probability /= sum;
    h.symmetry.reset();
    if (!found.hypotheses.empty()) h.symmetry = find_symmetry(problem, best.pose, w.pose);
    found.hypotheses.push_back(std::move(h));
  }
  return shares.back() / sum;
}

/// Probability that the best hypothesis is wrong; not 1 - probability, which is rounded.
double risk_of(const Identification& found, double none) {
  double risk = none;
  for (std::size_t i = 1; i < found.hypotheses.size(); ++i) risk += found.hypotheses[i].probability;
  for (const Hypothesis& h : found.excluded) risk += h.probability;
  const double rest = found.hypotheses.front().matches.size() < strong_matches ? found.untried : 0;
  return risk + (1 - risk) * rest;
}

void remove_negligible(std::vector<Hypothesis>& hypotheses) {
  hypotheses.erase(
      std::remove_if(hypotheses.begin() + 1, hypotheses.end(),
                     [](const Hypothesis& h) { return h.probability < min_listed_probability; }),
      hypotheses.end());
}

/// Lists the symmetries that relate the hypotheses.
std::string symmetries_of(const std::vector<Hypothesis>& hypotheses) {
  constexpr std::size_t max_listed = 3;
  std::ostringstream text;
  std::size_t repeats = 0;
  for (std::size_t i = 1; i < hypotheses.size(); ++i) {
    if (hypotheses[i].symmetry->kind == SymmetryKind::none || ++repeats > max_listed) continue;
    text << (repeats > 1 ? "; " : "") << hypotheses[i].symmetry->text;
  }
  if (repeats > max_listed) text << "; and " << repeats - max_listed << " more";
  return text.str();
}

}  // namespace

std::vector<pose::LogEvidence> evidences_of(const AssignmentProblem& problem,
                                            const std::vector<Hypothesis>& hypotheses) {
  return evidences_of(problem, with_poses(problem, hypotheses));
}

std::string doubt_message(std::size_t poses, double best, double none,
                          const std::string& symmetries) {
  const double others = 1 - best - none;
  std::ostringstream text;
  text.precision(2);
  if (none > accidental)
    text << "the poses found are accidental with a probability of " << none
         << ": the blobs that they match are more likely other lights; a prior or lamp codes can "
            "help";
  else if (poses > 1 && others >= none)
    text << poses << " poses match the image" << (symmetries.empty() ? "" : ": ") << symmetries
         << "; the best is right with a probability of " << best
         << "; a prior (position, heading or gravity) or lamp codes can select one";
  else
    text << "the only pose found may be accidental: with a probability of " << none
         << " the blobs that it matches are other lights; more lamps in view, a prior, lamp codes "
            "or fewer false lights reduce it";
  return text.str();
}

void conclude(const AssignmentProblem& problem, Result<Identification>& result) {
  Identification& found = result.value;
  if (!result.ok() || found.hypotheses.empty()) return;
  const double none = weigh(problem, found);
  found.risk = risk_of(found, none);
  remove_negligible(found.hypotheses);
  if (found.risk <= problem.options->max_risk) return;
  result.status = none > accidental ? Status::no_pose : Status::ambiguous;
  const auto rivals =
      std::count_if(found.excluded.begin(), found.excluded.end(),
                    [](const Hypothesis& h) { return h.probability >= min_listed_probability; });
  const std::string notes = std::move(result.message);
  result.message =
      doubt_message(found.hypotheses.size() + static_cast<std::size_t>(rivals),
                    found.hypotheses.front().probability, none, symmetries_of(found.hypotheses)) +
      (notes.empty() ? "" : "; ") + notes;
}

}  // namespace occ::internal::identify
