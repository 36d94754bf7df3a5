// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/locate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/require.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/refine/internal/budget.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"

namespace occ {

using namespace internal::locate;
using namespace internal::refine;
namespace {

/// Expected number of wrong poses that may explain as many lamps, when the best one's residuals are
/// larger than they should be. (Four lamps of six are explained by chance in some 0.05 ways.)
constexpr double chance_of_misfits = 1e-3;

/// Seconds since construction.
class Clock {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// A candidate and what ranks it.
struct Ranked {
  Candidate candidate;
  Status status = Status::ok;
  std::string message;
  std::vector<Match> matches;
  double variance_factor = 1;
  const Hypothesis* hypothesis = nullptr;
  bool fits = false;        // solved, or on its way to an even better fit
  bool unfinished = false;  // on its way
  bool misfits = false;     // residuals exceed the stated sigmas, and no rim speaks for it
  double measured = 0;      // chi-square of rims and centroids
  double assumed = 0;       // chi-square of the prior and of missed lamps
};

void set_pose(const Refined& refined, Candidate& candidate) {
  candidate.cam_from_world = refined.cam_from_world;
  candidate.covariance = refined.covariance;
  candidate.position_m = refined.cam_from_world.origin_in_source();
  candidate.rms_px = refined.rms_px;
  candidate.chi2 = refined.chi2;
  candidate.dof = refined.dof;
}

Ranked refine_hypothesis(const Hypothesis& hypothesis, const std::vector<Blob>& blobs,
                         const Scene& scene, const LocateOptions& options) {
  RefineOptions refine_options = options.refine;
  refine_options.rung = std::min(refine_options.rung, Rung::rims);
  const Result<Refined> refined =
      refine(hypothesis.cam_from_world, hypothesis.matches, blobs, scene, refine_options);
  Ranked ranked;
  ranked.status = refined.status;
  ranked.message = refined.message;
  if (refined.ok()) ranked.message = size_contradiction(*refined, blobs, scene);
  if (refined.ok() && !ranked.message.empty()) ranked.status = Status::no_pose;
  ranked.hypothesis = &hypothesis;
  ranked.unfinished = refined.status == Status::not_converged && refined->iterations > 0;
  ranked.fits = ranked.status == Status::ok || ranked.unfinished;
  ranked.variance_factor = refined->variance_factor;
  ranked.misfits = refined->variance_factor > 1 &&
                   std::none_of(hypothesis.matches.begin(), hypothesis.matches.end(),
                                [&](const Match& match) { return !blobs[match.blob].rim.empty(); });
  ranked.matches = hypothesis.matches;
  const double prior = options.prior ? options.prior->chi2(refined->cam_from_world) : 0;
  ranked.measured = refined->chi2 - prior;
  ranked.assumed = prior + options.identify.miss_penalty * hypothesis.missed;
  Candidate& candidate = ranked.candidate;
  set_pose(*refined, candidate);
  for (const Match& match : hypothesis.matches) {
    candidate.lamps.emplace(scene.lamps[match.lamp].id, blobs[match.blob]);
  }
  return ranked;
}

/// What fits before what does not, then more lamps explained, then the better fit. One that has not
/// converged counts by what it has reached: were it passed over, a worse one would be the answer.
bool better(const Ranked& a, const Ranked& b) {
  if (a.fits != b.fits) return a.fits;
  if (a.matches.size() != b.matches.size()) return a.matches.size() > b.matches.size();
  return a.measured + a.assumed < b.measured + b.assumed;
}

/// Whether one cannot be told from the best. A misfit that is common to all (an imperfect lens or
/// map) says nothing about which one is right, so differences count in units of the best one's
/// misfit.
bool plausible_beside(const Ranked& best, const Ranked& r) {
  const double misfit =
      best.candidate.dof > 0 ? std::max(1.0, best.measured / best.candidate.dof) : 1.0;
  const double worse = (r.measured - best.measured) / misfit + r.assumed - best.assumed;
  return r.fits == best.fits && r.matches.size() >= best.matches.size() && worse <= plausible_chi2;
}

/// Best first. Those that have not converged go on from where they are if they matter.
void rank(std::vector<Ranked>& ranked, const std::vector<Blob>& blobs, const Scene& scene,
          LocateOptions options) {
  constexpr int times_longer = 10;
  options.refine.max_iterations *= times_longer;
  while (true) {
    std::stable_sort(ranked.begin(), ranked.end(), better);
    const auto next = std::find_if(ranked.begin(), ranked.end(), [&](const Ranked& r) {
      return r.unfinished && plausible_beside(ranked.front(), r);
    });
    if (next == ranked.end()) return;
    const Hypothesis* const named = next->hypothesis;
    Hypothesis reached = *named;
    reached.cam_from_world = next->candidate.cam_from_world;
    *next = refine_hypothesis(reached, blobs, scene, options);
    next->hypothesis = named;
    next->unfinished = false;
  }
}

/// Several namings can lead to one pose once every rim is used: the better one stands for it.
void merge_equal_poses(std::vector<Ranked>& ranked) {
  constexpr double same_pose_chi2 = 1;
  std::vector<Ranked> distinct;
  for (const Ranked& r : ranked) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Ranked& d) {
      const Vector6 delta = difference(r.candidate.cam_from_world, d.candidate.cam_from_world);
      return delta.dot(d.candidate.covariance.llt().solve(delta)) < same_pose_chi2;
    });
    if (!known) distinct.push_back(r);
  }
  ranked = std::move(distinct);
}

/// Poses are ranked by rims, which are the same observations for each; pixels then refine them.
void refine_by_pixels(const std::vector<Blob>& blobs, const Scene& scene,
                      const RefineOptions& options, const ImageView& image, Ranked& ranked) {
  if (ranked.status != Status::ok) return;
  const Result<Refined> refined =
      refine(ranked.candidate.cam_from_world, ranked.matches, blobs, scene, options, image);
  if (!refined.ok()) return;
  set_pose(*refined, ranked.candidate);
  ranked.variance_factor = refined->variance_factor;
}

void fill_fix(Fix& fix, const std::vector<Ranked>& ranked) {
  for (const Ranked& r : ranked) fix.candidates.push_back(r.candidate);
  take_best(fix);
}

std::string ambiguity_message(std::size_t count) {
  std::ostringstream text;
  text << count
       << " poses explain the image equally well; a prior (position, heading or gravity) or "
       << "lamp codes can tell them apart";
  return text.str();
}

/// All hypotheses by the rung that was chosen, as far as they can be told from the best, best
/// first.
std::vector<Ranked> refine_all(const std::vector<Hypothesis>& hypotheses,
                               const std::vector<Blob>& blobs, const Scene& scene,
                               const LocateOptions& options, const ImageView* image) {
  std::vector<Ranked> ranked;
  int solved = 0;
  for (const Hypothesis& hypothesis : hypotheses) {
    ranked.push_back(refine_hypothesis(hypothesis, blobs, scene, options));
    solved += ranked.back().status == Status::ok;
    if (solved == options.max_candidates) break;
  }
  rank(ranked, blobs, scene, options);
  const Ranked best = ranked.front();
  ranked.erase(std::remove_if(ranked.begin() + 1, ranked.end(),
                              [&](const Ranked& r) { return !plausible_beside(best, r); }),
               ranked.end());
  merge_equal_poses(ranked);
  if (image && options.refine.rung == Rung::direct) {
    for (Ranked& r : ranked) refine_by_pixels(blobs, scene, options.refine, *image, r);
  }
  return ranked;
}

/// Where nobody asked beforehand: the covariance is the bound of the observations at the fix.
void complete(RungChoice& choice, const Ranked& best) {
  if (choice.predicted_sigma_m || best.status != Status::ok) return;
  const Candidate& c = best.candidate;
  const double trace_m2 = position_covariance(c.cam_from_world, c.covariance).trace();
  choice.predicted_sigma_m = std::sqrt(trace_m2 / best.variance_factor);
}

void conclude(const std::vector<Ranked>& ranked, const Result<Identification>& identified,
              Result<Fix>& result) {
  const Ranked& best = ranked.front();
  const Ranked& worst = *std::find_if(ranked.begin(), ranked.end() - 1,
                                      [](const Ranked& r) { return r.status != Status::ok; });
  result.status = worst.status;
  result.message = worst.message;
  if (result.ok() && ranked.size() > 1) {
    result.status = Status::ambiguous;
    result.message = ambiguity_message(ranked.size());
  } else if (result.ok() && identified->may_be_chance) {
    result.status = identified.status;
    result.message = identified.message;
  } else if (result.ok() && best.misfits && identified->chance > chance_of_misfits) {
    result.status = Status::ambiguous;
    result.message =
        "the one pose found fits badly and may be chance: " + std::to_string(identified->chance) +
        " wrong ones are expected to fit as well";
  } else if (result.ok() && !result->choice->met) {
    result.status = Status::budget_not_met;
    result.message = result->choice->reason;
  }
}

Result<Fix> locate_blobs(const std::vector<Blob>& blobs, const Scene& scene,
                         const LocateOptions& given, const ImageView* image, const Clock& clock) {
  Result<Fix> result;
  Fix& fix = result.value;
  fix.blobs = blobs;
  if (blobs.empty()) {
    result.status = Status::no_lamps;
    result.message = "nothing in the image stands out from the background";
    return result;
  }
  LocateOptions options = given;
  if (options.prior) options.identify.prior = options.refine.prior = options.prior;

  const Clock identify_clock;
  const Result<Identification> identified = identify(blobs, scene, options.identify);
  fix.timing_s.identify_s = identify_clock.seconds();
  if (identified->hypotheses.empty()) {
    result.status = identified.status;
    result.message = identified.message;
    return result;
  }

  const Clock refine_clock;
  fix.choice = rung_for({identified->hypotheses, blobs, scene, options.refine, options.costs,
                         options.max_candidates, options.budget_s, options.target_sigma_m, image},
                        [&] { return clock.seconds(); });
  options.refine.rung = fix.choice->rung;
  const std::vector<Ranked> ranked =
      refine_all(identified->hypotheses, blobs, scene, options, image);
  complete(*fix.choice, ranked.front());
  fix.timing_s.refine_s = refine_clock.seconds();
  fill_fix(fix, ranked);
  conclude(ranked, identified, result);
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
  check(budget_s, "budget_s");
  check(target_sigma_m, "target_sigma_m");
  costs.validate();
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
