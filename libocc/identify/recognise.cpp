// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/recognise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "libocc/core/require.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/false_alarms.hpp"
#include "libocc/identify/internal/verdict.hpp"
#include "libocc/pose/internal/evidence.hpp"

namespace occ {

using namespace internal::identify;
namespace {

// The match of an object, with the evidence of its poses.
struct Found {
  ObjectMatch match;
  std::vector<double> logs;              // of the poses, less ln of the number of objects
  std::vector<double> logs_prior_wrong;  // the same if a part of the prior is wrong
  double untried = 0;                    // share of the groups of blobs left out
};

class Recogniser {
 public:
  Recogniser(const std::vector<Blob>& blobs, const std::vector<Object>& objects,
             const Camera& camera, const RecogniseOptions& options)
      : blobs_(blobs), objects_(objects), camera_(camera), options_(options) {
    for (int i = 0; i < static_cast<int>(blobs.size()); ++i) remaining_.push_back(i);
  }

  Recognition run();
  bool cut_short() const { return cut_short_; }

 private:
  void identify(std::size_t object);
  double log10_objects() const { return std::log10(static_cast<double>(objects_.size())); }
  double max_log10_false_alarms() const {  // of a single object
    return std::log10(options_.max_false_alarms) - log10_objects();
  }
  bool is_significant(const ObjectMatch& match) const {
    return match.log10_false_alarms <= std::log10(options_.max_false_alarms);
  }
  std::optional<std::size_t> next() const;
  std::vector<Found> rivals_of(const Hypothesis& first, std::size_t best) const;
  RecognisedObject accept(std::size_t best);

  const std::vector<Blob>& blobs_;
  const std::vector<Object>& objects_;
  const Camera& camera_;
  const RecogniseOptions& options_;
  std::vector<int> remaining_;  // indices of blobs that no accepted object uses
  std::vector<std::optional<Found>> best_;
  bool cut_short_ = false;
};

bool share_blobs(const Hypothesis& a, const Hypothesis& b) {
  return std::any_of(a.matches.begin(), a.matches.end(), [&](const Match& m) {
    return std::any_of(b.matches.begin(), b.matches.end(),
                       [&](const Match& other) { return other.blob == m.blob; });
  });
}

bool contains(const Hypothesis& h, int blob) {
  return std::any_of(h.matches.begin(), h.matches.end(),
                     [&](const Match& m) { return m.blob == blob; });
}

// Sorts the poses by evidence; equal ones keep their order.
void sort_by_evidence(Found& found) {
  std::vector<std::size_t> order(found.logs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto rounded = [&](std::size_t i) { return std::round(20 * found.logs[i]); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return rounded(a) > rounded(b); });
  Found sorted = found;
  for (std::size_t i = 0; i < order.size(); ++i) {
    sorted.match.poses[i] = found.match.poses[order[i]];
    sorted.logs[i] = found.logs[order[i]];
    sorted.logs_prior_wrong[i] = found.logs_prior_wrong[order[i]];
  }
  found = std::move(sorted);
}

// Removes the poses of negligible probability, except the first, and counts the plausible ones.
void remove_improbable(ObjectMatch& match) {
  constexpr double plausible = 1e-3;
  const double first = match.poses.front().probability;
  match.poses.erase(std::remove_if(match.poses.begin() + 1, match.poses.end(),
                                   [](const Hypothesis& pose) {
                                     return pose.probability < min_listed_probability;
                                   }),
                    match.poses.end());
  match.plausible = static_cast<int>(
      std::count_if(match.poses.begin(), match.poses.end(),
                    [&](const Hypothesis& pose) { return pose.probability >= plausible * first; }));
}

// Identifies the object in the remaining blobs. The false alarms are those in the image of all
// blobs, because all of them have been tried.
void Recogniser::identify(std::size_t object) {
  best_[object].reset();
  std::vector<Blob> blobs;
  for (const int i : remaining_) blobs.push_back(blobs_[i]);
  const AssignmentProblem all = make_problem(blobs_, objects_[object], camera_, options_.identify);
  AssignmentProblem problem = make_problem(blobs, objects_[object], camera_, options_.identify);
  problem.min_pairs = min_pairs(all, max_log10_false_alarms());
  if (problem.min_pairs > static_cast<int>(problem.observations.size())) return;
  Result<Identification> found = solve_assignment(problem);
  cut_short_ = cut_short_ || found->cut_short;
  if (found->hypotheses.empty()) return;
  Found result;
  ObjectMatch& match = result.match;
  match.object = static_cast<int>(object);
  match.poses = std::move(found.value.hypotheses);
  const double log_objects = std::log(static_cast<double>(objects_.size()));
  for (const internal::pose::LogEvidence& log : evidences_of(problem, match.poses)) {
    result.logs.push_back(log.value - log_objects);
    result.logs_prior_wrong.push_back(log.if_excluded(found->excluded_listed) - log_objects);
  }
  result.untried = found->untried;
  for (Hypothesis& h : match.poses)
    for (Match& m : h.matches) m.blob = remaining_[m.blob];
  sort_by_evidence(result);
  match.log10_false_alarms = log10_false_alarms(all, match.poses.front()) + log10_objects();
  best_[object] = std::move(result);
}

// Returns the significant match of the largest evidence that is not used up.
std::optional<std::size_t> Recogniser::next() const {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < best_.size(); ++i)
    if (best_[i] && is_significant(best_[i]->match) && best_[i]->logs.front() > 0 &&
        (!best || best_[i]->logs.front() > best_[*best]->logs.front()))
      best = i;
  return best;
}

// Returns the poses of all objects that share blobs with the first pose of the best object, which
// comes first. Other poses may belong to another instance of the object.
std::vector<Found> Recogniser::rivals_of(const Hypothesis& first, std::size_t best) const {
  std::vector<Found> rivals;
  for (std::size_t i = 0; i < best_.size(); ++i) {
    if (!best_[i]) continue;
    Found rival = *best_[i];
    rival.match.poses.clear(), rival.logs.clear(), rival.logs_prior_wrong.clear();
    for (std::size_t k = 0; k < best_[i]->logs.size(); ++k) {
      if (!share_blobs(best_[i]->match.poses[k], first)) continue;
      rival.match.poses.push_back(best_[i]->match.poses[k]);
      rival.logs.push_back(best_[i]->logs[k]);
      rival.logs_prior_wrong.push_back(best_[i]->logs_prior_wrong[k]);
    }
    if (!rival.logs.empty()) rivals.insert(i == best ? rivals.begin() : rivals.end(), rival);
  }
  return rivals;
}

RecognisedObject Recogniser::accept(std::size_t best) {
  const Hypothesis first = best_[best]->match.poses.front();
  std::vector<Found> rivals = rivals_of(first, best);
  std::vector<double> logs;
  double log_none = 0;
  for (const Found& rival : rivals) {
    logs.insert(logs.end(), rival.logs.begin(), rival.logs.end());
    for (const double log : rival.logs_prior_wrong)
      log_none = std::max(log_none, std::log(excluded_by_prior) + log);
  }
  const std::vector<double> shares = internal::pose::probabilities(logs, log_none);
  RecognisedObject accepted;
  accepted.risk = shares.back();
  for (std::size_t i = 1; i < logs.size(); ++i) accepted.risk += shares[i];
  if (first.matches.size() < strong_matches)
    accepted.risk += (1 - accepted.risk) * rivals.front().untried;
  auto share = shares.begin();
  for (Found& rival : rivals) {
    for (Hypothesis& pose : rival.match.poses) pose.probability = *share++;
    const double most = rival.match.poses.front().probability;
    remove_improbable(rival.match);
    if (&rival == &rivals.front())
      accepted.match = std::move(rival.match);
    else if (most >= min_listed_probability)
      accepted.rivals.push_back(std::move(rival.match));
  }
  if (!(accepted.risk <= options_.identify.max_risk)) accepted.status = Status::ambiguous;
  remaining_.erase(std::remove_if(remaining_.begin(), remaining_.end(),
                                  [&](int blob) { return contains(first, blob); }),
                   remaining_.end());
  return accepted;
}

Recognition Recogniser::run() {
  Recognition result;
  best_.resize(objects_.size());
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    identify(i);
    result.log10_false_alarms.push_back(best_[i] ? best_[i]->match.log10_false_alarms
                                                 : std::numeric_limits<double>::infinity());
  }
  while (const auto best = next()) {
    result.found.push_back(accept(*best));
    const Hypothesis& accepted = result.found.back().match.poses.front();
    for (std::size_t i = 0; i < best_.size(); ++i)
      if (best_[i] && share_blobs(best_[i]->match.poses.front(), accepted)) identify(i);
  }
  return result;
}

}  // namespace

void RecogniseOptions::validate() const {
  identify.validate();
  require(max_false_alarms > 0 && std::isfinite(max_false_alarms), "max_false_alarms",
          max_false_alarms, "positive");
}

Result<Recognition> recognise(const std::vector<Blob>& blobs, const std::vector<Object>& objects,
                              const Camera& camera, const RecogniseOptions& options) {
  options.validate();
  require_finite(blobs);
  require(!objects.empty(), "objects", "none", "at least one");
  Result<Recognition> result;
  const std::size_t whole =
      make_problem(blobs, objects.front(), camera, options.identify).observations.size();
  result.value.log10_false_alarms.assign(objects.size(), std::numeric_limits<double>::infinity());
  if (whole < 4) {
    result.status = Status::too_few_lamps;
    result.message = "at least four whole blobs are needed: the image has " + std::to_string(whole);
    return result;
  }
  Recogniser recogniser(blobs, objects, camera, options);
  result.value = recogniser.run();
  if (result->found.empty()) {
    result.status = Status::no_pose;
    result.message = "no object matches more blobs than expected by chance";
  }
  for (const RecognisedObject& object : result->found)
    if (object.status == Status::ambiguous) {
      result.status = Status::ambiguous;
      result.message =
          "an object has several poses, several objects match the same blobs, or the blobs are "
          "other lights, with a probability above max_risk";
    }
  if (recogniser.cut_short())
    result.message += (result.message.empty() ? "" : "; ") +
                      std::string("a search stopped after max_hypotheses = ") +
                      std::to_string(options.identify.max_hypotheses) + " or max_time_s";
  return result;
}

}  // namespace occ
