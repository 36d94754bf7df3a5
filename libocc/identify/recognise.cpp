// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/recognise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libocc/core/require.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/false_alarms.hpp"

namespace occ {

using namespace internal::identify;
namespace {

constexpr double rival_log10 = 3;  // of likelihood: rivals within a ratio of 1000

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
  RecognisedObject accept(std::size_t best);

  const std::vector<Blob>& blobs_;
  const std::vector<Object>& objects_;
  const Camera& camera_;
  const RecogniseOptions& options_;
  std::vector<int> remaining_;  // indices of blobs that no accepted object uses
  std::vector<std::optional<ObjectMatch>> best_;
  bool cut_short_ = false;
};

// Decimal logarithm of false alarms over likelihood. Among significant matches the likelihood
// decides, because it penalises points that should be visible but are not.
double log10_cost(const ObjectMatch& match) {
  return match.log10_false_alarms + match.poses.front().chi2 / (2 * std::log(10.0));
}

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
  ObjectMatch match;
  match.object = static_cast<int>(object);
  match.poses = std::move(found.value.hypotheses);
  for (Hypothesis& h : match.poses)
    for (Match& m : h.matches) m.blob = remaining_[m.blob];
  match.plausible =
      static_cast<int>(std::count_if(match.poses.begin(), match.poses.end(), [&](const auto& h) {
        return h.chi2 <= match.poses.front().chi2 + max_hypothesis_delta_chi2;
      }));
  match.log10_false_alarms = log10_false_alarms(all, match.poses.front()) + log10_objects();
  best_[object] = std::move(match);
}

RecognisedObject Recogniser::accept(std::size_t best) {
  RecognisedObject accepted;
  accepted.match = *best_[best];
  const Hypothesis& first = accepted.match.poses.front();
  for (const auto& other : best_)
    if (other && other->object != accepted.match.object && is_significant(*other) &&
        log10_cost(*other) <= log10_cost(accepted.match) + rival_log10 &&
        share_blobs(other->poses.front(), first))
      accepted.rivals.push_back(*other);
  if (accepted.match.plausible > 1 || !accepted.rivals.empty()) accepted.status = Status::ambiguous;
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
    result.log10_false_alarms.push_back(best_[i] ? best_[i]->log10_false_alarms
                                                 : std::numeric_limits<double>::infinity());
  }
  for (;;) {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < best_.size(); ++i)
      if (best_[i] && is_significant(*best_[i]) &&
          (!best || log10_cost(*best_[i]) < log10_cost(*best_[*best])))
        best = i;
    if (!best) return result;
    result.found.push_back(accept(*best));
    const Hypothesis& accepted = result.found.back().match.poses.front();
    for (std::size_t i = 0; i < best_.size(); ++i)
      if (best_[i] && share_blobs(best_[i]->poses.front(), accepted)) identify(i);
  }
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
          "an object has several plausible poses, or several objects match the same blobs";
    }
  if (recogniser.cut_short())
    result.message += (result.message.empty() ? "" : "; ") +
                      std::string("a search stopped after max_hypotheses = ") +
                      std::to_string(options.identify.max_hypotheses) + " or max_time_s";
  return result;
}

}  // namespace occ
