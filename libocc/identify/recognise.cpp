// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/recognise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libocc/core/require.hpp"
#include "libocc/identify/internal/false_alarms.hpp"
#include "libocc/identify/internal/verdict.hpp"

namespace occ {

using namespace internal::identify;
namespace {

constexpr double plausible_chi2 = 13.8;  // 2 ln 1000
constexpr double as_likely = 3;          // decades

class Recogniser {
 public:
  Recogniser(const std::vector<Blob>& blobs, const std::vector<Object>& objects,
             const Camera& camera, const RecogniseOptions& options)
      : blobs_(blobs), objects_(objects), camera_(camera), options_(options) {
    for (int i = 0; i < static_cast<int>(blobs.size()); ++i) left_.push_back(i);
  }

  Recognition run();
  bool cut_short() const { return cut_short_; }

 private:
  void look_for(std::size_t object);
  double log10_objects() const { return std::log10(static_cast<double>(objects_.size())); }
  double max_log10_false_alarms() const {  // of one object
    return std::log10(options_.max_false_alarms) - log10_objects();
  }
  bool is_sure(const ObjectMatch& match) const {
    return match.log10_false_alarms <= std::log10(options_.max_false_alarms);
  }
  RecognisedObject take(std::size_t best);

  const std::vector<Blob>& blobs_;
  const std::vector<Object>& objects_;
  const Camera& camera_;
  const RecogniseOptions& options_;
  std::vector<int> left_;  // blobs that no object has taken
  std::vector<std::optional<ObjectMatch>> best_;
  bool cut_short_ = false;
};

// Where chance is low, likelihood decides: what an object should show but does not speaks against
// it.
double decades(const ObjectMatch& match) {
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

// In what is left; by chance among all blobs, as everything has been tried on them.
void Recogniser::look_for(std::size_t object) {
  best_[object].reset();
  std::vector<Blob> blobs;
  for (const int i : left_) blobs.push_back(blobs_[i]);
  const AssignmentProblem all = make_problem(blobs_, objects_[object], camera_, options_.identify);
  AssignmentProblem problem = make_problem(blobs, objects_[object], camera_, options_.identify);
  problem.min_pairs = min_pairs(all, max_log10_false_alarms());
  if (problem.min_pairs > static_cast<int>(problem.sightings.size())) return;
  Result<Identification> found = verdict(problem);
  cut_short_ = cut_short_ || found->tried >= options_.identify.max_hypotheses;
  if (found->hypotheses.empty()) return;
  ObjectMatch match;
  match.object = static_cast<int>(object);
  match.poses = std::move(found.value.hypotheses);
  for (Hypothesis& h : match.poses)
    for (Match& m : h.matches) m.blob = left_[m.blob];
  match.plausible =
      static_cast<int>(std::count_if(match.poses.begin(), match.poses.end(), [&](const auto& h) {
        return h.chi2 <= match.poses.front().chi2 + plausible_chi2;
      }));
  match.log10_false_alarms = log10_false_alarms(all, match.poses.front()) + log10_objects();
  best_[object] = std::move(match);
}

RecognisedObject Recogniser::take(std::size_t best) {
  RecognisedObject taken;
  taken.match = *best_[best];
  const Hypothesis& first = taken.match.poses.front();
  for (const auto& other : best_)
    if (other && other->object != taken.match.object && is_sure(*other) &&
        decades(*other) <= decades(taken.match) + as_likely &&
        share_blobs(other->poses.front(), first))
      taken.rivals.push_back(*other);
  if (taken.match.plausible > 1 || !taken.rivals.empty()) taken.status = Status::ambiguous;
  left_.erase(
      std::remove_if(left_.begin(), left_.end(), [&](int blob) { return contains(first, blob); }),
      left_.end());
  return taken;
}

Recognition Recogniser::run() {
  Recognition result;
  best_.resize(objects_.size());
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    look_for(i);
    result.log10_false_alarms.push_back(best_[i] ? best_[i]->log10_false_alarms
                                                 : std::numeric_limits<double>::infinity());
  }
  for (;;) {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < best_.size(); ++i)
      if (best_[i] && is_sure(*best_[i]) && (!best || decades(*best_[i]) < decades(*best_[*best])))
        best = i;
    if (!best) return result;
    result.found.push_back(take(*best));
    const Hypothesis& taken = result.found.back().match.poses.front();
    for (std::size_t i = 0; i < best_.size(); ++i)
      if (best_[i] && share_blobs(best_[i]->poses.front(), taken)) look_for(i);
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
  check(blobs);
  require(!objects.empty(), "objects", "none", "at least one");
  Result<Recognition> result;
  const std::size_t whole =
      make_problem(blobs, objects.front(), camera, options.identify).sightings.size();
  result.value.log10_false_alarms.assign(objects.size(), std::numeric_limits<double>::infinity());
  if (whole < 4) {
    result.status = Status::too_few_lamps;
    result.message =
        "four whole blobs are needed: the image has " + std::to_string(whole) + " of them";
    return result;
  }
  Recogniser recogniser(blobs, objects, camera, options);
  result.value = recogniser.run();
  if (result->found.empty()) {
    result.status = Status::no_pose;
    result.message = "no object explains more blobs than chance would";
  }
  for (const RecognisedObject& object : result->found)
    if (object.status == Status::ambiguous) {
      result.status = Status::ambiguous;
      result.message = "an object fits in several poses, or several objects fit the same blobs";
    }
  if (recogniser.cut_short())
    result.message += (result.message.empty() ? "" : "; ") +
                      std::string("a search stopped after max_hypotheses = ") +
                      std::to_string(options.identify.max_hypotheses);
  return result;
}

}  // namespace occ
