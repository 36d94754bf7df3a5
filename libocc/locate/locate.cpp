// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/locate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

#include "libocc/core/require.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/internal/suspects.hpp"
#include "libocc/refine/internal/ranking.hpp"

namespace occ {

using namespace internal::locate;
using namespace internal::refine;
namespace {

/// Time since construction.
class Clock {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Candidate candidate_of(const RankedPose& pose, const std::vector<Blob>& blobs, const Scene& scene) {
  const Refined& refined = *pose.refined;
  Candidate candidate;
  candidate.cam_from_world = refined.cam_from_world;
  candidate.covariance = refined.covariance;
  candidate.position_m = refined.cam_from_world.origin_in_source();
  candidate.rms_px = refined.rms_px;
  candidate.chi2 = refined.chi2;
  candidate.dof = refined.dof;
  candidate.probability = pose.probability;
  for (const Match& match : pose.hypothesis->matches)
    candidate.lamps.emplace(scene.lamps[match.lamp].id, blobs[match.blob]);
  return candidate;
}

/// The poses are no answer where it is more probable that none of them is right.
constexpr double accidental = 0.5;

/// Names the rivals of the best pose and the probability that none of the poses is right.
std::string doubt_message(const Refinement& refinement) {
  const auto rivals = refinement.poses.size() - 1;
  const RankedPose& best = refinement.poses.front();
  const double none = refinement.none, others = 1 - best.probability - none;
  std::ostringstream text;
  text.precision(2);
  if (none > accidental)
    text << "the poses found are accidental with a probability of " << none
         << ": the blobs that they match are more likely other lights; a prior or lamp codes can "
            "help";
  else if (rivals > 0 && others >= none)
    text << rivals + 1 << " poses match the image; the best is right with a probability of "
         << best.probability
         << "; a prior (position, heading or gravity) or lamp codes can select one";
  else
    text << "the only pose found may be accidental: with a probability of " << none
         << " the blobs that it matches are other lights; more lamps in view, a prior, lamp codes "
            "or fewer false lights reduce it";
  return text.str();
}

/// Status and message of the fix. The first pose that was not refined determines them, then the
/// risk, then the budget.
void conclude(const Refinement& refinement, double max_risk, Result<Fix>& result) {
  const std::vector<RankedPose>& poses = refinement.poses;
  const Result<Refined>& worst =
      std::find_if(poses.begin(), poses.end() - 1, [](const RankedPose& pose) {
        return !pose.refined.ok();
      })->refined;
  result.status = worst.status;
  result.message = worst.message;
  if (!result.ok()) return;
  if (!(*result->risk <= max_risk)) {
    result.status = refinement.none > accidental ? Status::no_pose : Status::ambiguous;
    result.message = doubt_message(refinement);
  } else if (!refinement.choice.met) {
    result.status = Status::budget_not_met;
    result.message = refinement.choice.reason;
  }
}

/// Probability that the best pose is wrong; not 1 - probability, which is rounded.
double risk_of(const Refinement& refinement) {
  double risk = refinement.none;
  for (auto pose = refinement.poses.begin() + 1; pose != refinement.poses.end(); ++pose)
    risk += pose->probability;
  return risk;
}

Result<Fix> locate_blobs(const std::vector<Blob>& blobs, const Scene& scene,
                         const LocateOptions& given, const ImageView* image, const Clock& clock) {
  Result<Fix> result;
  Fix& fix = result.value;
  fix.blobs = blobs;
  fix.risk = 1;
  if (blobs.empty()) {
    result.status = Status::no_lamps;
    result.message = "nothing in the image stands out from the background";
    return result;
  }
  LocateOptions options = given;
  options.identify.prior = options.refine.prior = options.prior;

  const Clock identify_clock;
  const Result<Identification> identified = identify(blobs, scene, options.identify);
  fix.timing_s.identify_s = identify_clock.seconds();
  if (identified->hypotheses.empty()) {
    result.status = identified.status;
    result.message = identified.message;
    return result;
  }

  const Clock refine_clock;
  const Refinement refinement = refine_hypotheses(
      {identified->hypotheses, blobs, scene, options.refine, options.costs, options.max_candidates,
       options.identify, options.budget_s, options.target_sigma_m, image},
      [&] { return clock.seconds(); });
  fix.choice = refinement.choice;
  fix.timing_s.refine_s = refine_clock.seconds();

  for (const RankedPose& pose : refinement.poses)
    fix.candidates.push_back(candidate_of(pose, blobs, scene));
  take_best(fix);
  fix.risk = risk_of(refinement);
  conclude(refinement, options.max_risk, result);
  if (!(fix.risk <= options.max_risk))
    result.message += suspects(*refinement.poses.front().refined, blobs, scene);
  return result;
}

void check_sizes(const ImageView& image, const Camera& camera) {
  if (image.width == camera.width() && image.height == camera.height()) return;
  std::ostringstream text;
  text << "image must be of the camera's size, " << camera.width() << " x " << camera.height()
       << " px, got " << image.width << " x " << image.height;
  throw std::invalid_argument(text.str());
}

Scene checked(Scene scene, const LocateOptions& options) {
  options.validate();
  scene.validate();
  return scene.as_rendered();
}

}  // namespace

void LocateOptions::validate() const {
  const auto check = [](const std::optional<double>& value, const char* name) {
    if (value) require(*value > 0 && std::isfinite(*value), name, *value, "positive");
  };
  require(max_candidates > 0, "max_candidates", max_candidates, "positive");
  require(max_risk > 0 && max_risk <= 1, "max_risk", max_risk, "above 0 and at most 1");
  check(budget_s, "budget_s");
  check(target_sigma_m, "target_sigma_m");
  costs.validate();
  if (identify.prior || refine.prior)
    throw std::invalid_argument(
        std::string(identify.prior ? "identify.prior" : "refine.prior") +
        " must not be set in LocateOptions; set LocateOptions::prior, which both steps use");
  if (prior) prior->validate();
}

Result<Fix> locate(const ImageView& image, const Scene& scene, const LocateOptions& options) {
  const Clock clock;
  image.validate();
  check_sizes(image, scene.camera);
  const Scene valid = checked(scene, options);
  DetectOptions detect_options = options.detect;
  if (!detect_options.sensor) detect_options.sensor = valid.sensor;
  const std::vector<Blob> blobs = detect(image, detect_options);
  const double detect_s = clock.seconds();
  Result<Fix> result = locate_blobs(blobs, valid, options, &image, clock);
  result.value.timing_s.detect_s = detect_s;
  result.value.timing_s.total_s = clock.seconds();
  return result;
}

Result<Fix> locate(const std::vector<Blob>& blobs, const Scene& scene,
                   const LocateOptions& options) {
  const Clock clock;
  Result<Fix> result = locate_blobs(blobs, checked(scene, options), options, nullptr, clock);
  result.value.timing_s.total_s = clock.seconds();
  return result;
}

}  // namespace occ
