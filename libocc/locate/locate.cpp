// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/locate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <iomanip>
#include <sstream>

#include "libocc/core/internal/image_levels.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/identify/internal/assignment_evidence.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/identify/internal/verdict.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/internal/detect_options.hpp"
#include "libocc/locate/internal/excluded_poses.hpp"
#include "libocc/locate/internal/exclusion.hpp"
#include "libocc/locate/internal/found_colour.hpp"
#include "libocc/locate/internal/hidden_sides.hpp"
#include "libocc/locate/internal/map_rivals.hpp"
#include "libocc/locate/internal/suspects.hpp"
#include "libocc/refine/internal/estimated_map.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"
#include "libocc/refine/internal/ranking.hpp"
#include "libocc/refine/internal/scene_errors.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"

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
  candidate.variance_factor = refined.variance_factor;
  candidate.estimated_map_sigma_m = refined.estimated_map_sigma_m;
  candidate.estimated_size_sigma = refined.estimated_size_sigma;
  candidate.estimated_growth_px = refined.estimated_growth_px;
  candidate.estimated_camera = refined.estimated_camera;
  candidate.probability = pose.probability;
  for (const Match& match : pose.hypothesis->matches)
    candidate.lamps.emplace(scene.lamps[match.lamp].id, blobs[match.blob]);
  return candidate;
}

/// "the focal length were 1.2 % longer and k1 0.05 larger"
std::string lens_errors_text(const Camera& estimated, const Camera& stated) {
  std::ostringstream text;
  const double longer = estimated.fx_px() / stated.fx_px() - 1;
  text << std::setprecision(2) << "the focal length were " << 100 * std::abs(longer) << " % "
       << (longer > 0 ? "longer" : "shorter");
  const auto k1_of = [](const Camera& camera) {
    for (const CameraParameter& parameter : camera.parameters())
      if (parameter.name == "k1") return parameter.value;
    return 0.0;
  };
  const double k1_error = k1_of(estimated) - k1_of(stated);
  if (k1_error != 0)
    text << " and k1 " << std::abs(k1_error) << (k1_error > 0 ? " larger" : " smaller");
  return text.str();
}

/// Empty unless the covariance allows for errors that the scene does not state.
std::string contradiction_message(const Refined& refined, const Scene& scene) {
  const bool is_lens = refined.estimated_camera && scene.camera.is_exact();
  const bool is_growth = refined.estimated_growth_px.has_value();
  constexpr double min_factor = 4;
  const bool is_estimated =
      is_lens || is_growth || refined.estimated_map_sigma_m || refined.estimated_size_sigma;
  if (!is_estimated && !(refined.variance_factor > min_factor)) return "";
  std::ostringstream text;
  text << std::setprecision(2);
  if (is_lens) {
    text << "the lamps contradict each other by more than their noise, as if "
         << lens_errors_text(*refined.estimated_camera, scene.camera)
         << ": calibrate the camera, or state its errors (parameter_sigmas)";
  } else if (is_growth) {
    const double growth_px = *refined.estimated_growth_px;
    text << "the sizes of the lamps' images do not match their directions, as if all outlines were "
         << std::abs(growth_px) << " px too " << (growth_px > 0 ? "large" : "small")
         << ": improve exposure or focus, or state the response of the camera (sensor.response)";
  } else if (!is_estimated) {
    text << "the residuals exceed their sigmas (variance factor " << refined.variance_factor
         << "): map, lens or outlines have errors that the scene does not state";
  } else if (refined.estimated_size_sigma) {
    text << "the sizes of the lamps' images do not match their directions, as if radius_m or "
         << "size_m had errors of " << 100 * *refined.estimated_size_sigma
         << " %: measure the lamps, improve exposure or focus, or state the errors (size_sigma)";
  } else {
    text << "the lamps contradict each other by more than their noise, as if their positions had "
         << "errors of " << 1e3 * *refined.estimated_map_sigma_m
         << " mm: measure the map, calibrate the lens, or state their errors (map_sigma_m, "
         << "parameter_sigmas)";
  }
  text << "; the covariance allows for them";
  return text.str();
}

/// See Fix::taken_as_exact.
std::vector<std::string> exact_parts(const Scene& scene, const RefineOptions& options) {
  std::vector<std::string> exact;
  if (options.model_sigma_px > 0) return exact;
  if (scene.camera.is_exact()) exact.emplace_back("camera");
  if (has_exact_map(scene)) exact.emplace_back("map");
  return exact;
}

/// A position that is less certain than the distance of the lamps is none.
void refuse_unknown_position(const Refined& best, const Scene& scene, Result<Fix>& result) {
  const double sigma_m = std::sqrt(result->position_covariance_m2.trace());
  const double distance_m = mean_distance_m(best, scene);
  if (!result.ok() || sigma_m < distance_m) return;
  result.status = Status::degenerate;
  std::ostringstream text;
  text << std::setprecision(2)
       << "the lamps do not determine the position: its standard deviation, " << sigma_m
       << " m, exceeds their distance, " << distance_m << " m";
  if (!result.message.empty()) text << "; " << result.message;
  result.message = text.str();
}

void add_message(const std::string& text, Result<Fix>& result) {
  if (text.empty()) return;
  result.message += (result.message.empty() ? "" : "; ") + text;
}

/// Status and message of the fix. The first pose that was not refined determines them, then the
/// risk, then the budget.
void conclude(const Refinement& refinement, const Scene& scene, double max_risk,
              Result<Fix>& result) {
  const std::vector<RankedPose>& poses = refinement.poses;
  const Result<Refined>& worst =
      std::find_if(poses.begin(), poses.end() - 1, [](const RankedPose& pose) {
        return !pose.refined.ok();
      })->refined;
  result.status = worst.status;
  result.message = worst.message;
  if (!result.ok()) return;
  if (!(*result->risk <= max_risk)) {
    const double none = refinement.none;
    result.status = none > internal::identify::accidental ? Status::no_pose : Status::ambiguous;
    result.message =
        internal::identify::doubt_message(poses.size(), poses.front().probability, none);
  } else if (!refinement.choice.met) {
    result.status = Status::budget_not_met;
    result.message = refinement.choice.reason;
  } else {
    result.message = contradiction_message(*poses.front().refined, scene);
    if (result.message.empty()) result.message = poses.front().refined.message;
  }
}

/// Probability that the best pose is wrong; not 1 - probability, which is rounded.
double risk_of(const Refinement& refinement) {
  double risk = refinement.none;
  for (auto pose = refinement.poses.begin() + 1; pose != refinement.poses.end(); ++pose)
    risk += pose->probability;
  return risk;
}

bool is_excluded(const std::optional<Prior>& prior, const Rigid3& cam_from_world) {
  return prior && prior->chi2(cam_from_world) > internal::identify::max_prior_chi2;
}

/// A search that was cut short may have missed a rival. Evidence alone excludes rivals by chance,
/// and those by a symmetry of the map are known (identify), but weak poses have others.
double risk_of_rest(const Identification& identified, const Hypothesis& best) {
  constexpr std::size_t strong_pairs = 6;  // as in identify
  return best.matches.size() < strong_pairs ? identified.untried : 0;
}

/// Probability that a light that a pose of one or two lamps rests on is no lamp of the map, but a
/// window or a lamp that the map lacks. One light fits as well if it has the same ratio of its
/// sides and, where the prior knows the distance, the same size. All discs have the same ratio, and
/// two of them, as on any ceiling, agree with two others of the map by chance.
double risk_of_strangers(const RankedPose& best, const Scene& scene, const std::vector<Blob>& blobs,
                         const std::optional<Prior>& prior) {
  constexpr double another = 0.1;  // an assumption: one bright light in ten is no lamp of the map
  constexpr double same_ratio = 0.006;  // 1 % of a factor between 1/7 and 7
  constexpr double same_pair = 0.2;     // found in rooms of two to seven discs: SlowOneLamp
  constexpr double log_sizes = 6;       // sizes vary by a factor of 400
  const std::vector<Match>& matches = best.hypothesis->matches;
  if (matches.size() > 2 || !best.refined.ok()) return 0;
  bool discs = true;
  double distance_m = 0;
  const Rigid3& pose = best.refined->cam_from_world;
  for (const Match& match : matches) {
    const Lamp& lamp = scene.lamps[match.lamp];
    if (blobs[match.blob].lamp_id) return 0;
    discs = discs && lamp.shape == LampShape::disc;
    distance_m = std::max(distance_m, (pose * lamp.centre_m).norm());
  }
  if (matches.size() == 2 && !discs) return 0;
  const double alike = matches.size() == 2 ? 2 * same_pair : discs ? 1 : same_ratio;
  double sigma_m = infinity;
  if (prior && prior->height_m) sigma_m = std::min(sigma_m, prior->height_sigma_m);
  if (prior && prior->position_m) sigma_m = std::min(sigma_m, prior->position_sigmas().maxCoeff());
  if (prior && prior->last_pose)
    sigma_m = std::min(sigma_m,
                       std::sqrt(prior->last_pose->covariance.bottomRightCorner<3, 3>().trace()));
  const double same_size = std::min(1.0, std::sqrt(2 * pi) * sigma_m / distance_m / log_sizes);
  return another * alike * same_size;
}

/// Adds a probability that none of the poses is right.
void add_doubt(double doubt, Refinement& refinement) {
  refinement.none += (1 - refinement.none) * doubt;
  for (RankedPose& pose : refinement.poses) pose.probability *= 1 - doubt;
}

/// Sentence about the poses that one disc allows.
std::string text_of_circle(const PoseCircle& circle, const Scene& scene) {
  std::ostringstream text;
  text.precision(3);
  text << "the outline of one disc allows circles of poses: if it is lamp "
       << scene.lamps[static_cast<std::size_t>(circle.lamp)].id << ", the camera is "
       << circle.radius_m << " m from its axis and " << circle.height_m
       << " m in front of it; a prior of the heading selects one";
  return text.str();
}

/// `untried`: share of the groups of blobs; 0 if the search with the prior was completed.
std::string text_of_cut(double untried) {
  if (!(untried > 0)) return "the search for poses that the prior excludes was cut short";
  return "the search for poses was cut short, with " +
         std::to_string(static_cast<int>(std::ceil(100 * untried))) +
         " % of the groups of blobs untried";
}

Attempt locate_as_measured(const std::vector<Blob>& blobs, const Scene& scene,
                           const LocateOptions& given, const ImageView* image, const Clock& clock) {
  Attempt attempt;
  Result<Fix>& result = attempt.fix;
  Fix& fix = result.value;
  fix.blobs = blobs;
  fix.risk = 1;
  fix.taken_as_exact = exact_parts(scene, given.refine);
  if (blobs.empty()) {
    result.status = Status::no_lamps;
    result.message = "nothing in the image stands out from the background";
    return attempt;
  }
  LocateOptions options = given;
  options.identify.prior = options.refine.prior = options.prior;

  // Share of the time left, less the time of ranking and fitting 64 poses; the rest is for rims.
  constexpr double search_share = 0.8, after_search_s = 1.5e-3, min_s = 1e-4;
  if (options.budget_s)
    options.identify.max_time_s = std::min(
        options.identify.max_time_s,
        std::max(min_s, search_share * (*options.budget_s - clock.seconds()) - after_search_s));
  const Clock identify_clock;
  Result<Identification> identified =
      internal::identify::search_hypotheses(blobs, scene, options.identify);
  fix.timing_s.identify_s = identify_clock.seconds();
  fix.cut_short = identified->cut_short;
  if (identified->hypotheses.empty()) {
    result.status = identified.status;
    result.message = identified.message;
    fix.circles = identified->circles;
    if (!fix.circles.empty()) add_message(text_of_circle(fix.circles.front(), scene), result);
    return attempt;
  }

  const Clock refine_clock;
  const auto elapsed_s = [&] { return clock.seconds(); };
  const auto ahead_of = [&](const std::vector<Hypothesis>& hypotheses, const LocateOptions& by) {
    return RefinementAhead{hypotheses,
                           blobs,
                           scene,
                           by.refine,
                           by.costs,
                           by.max_candidates,
                           by.identify,
                           by.budget_s,
                           by.target_sigma_m,
                           image,
                           identified->excluded_listed};
  };
  LocateOptions open = options;
  open.prior = open.identify.prior = open.refine.prior = std::nullopt;
  const RefinementAhead with_prior = ahead_of(identified->hypotheses, options);
  const RefinementAhead without_prior = ahead_of(identified->excluded, open);
  Refinement refinement = refine_hypotheses(with_prior, elapsed_s);
  const bool prior_is_wrong = take_excluded(without_prior, options.prior, elapsed_s, refinement);
  const RefinementAhead& ahead = prior_is_wrong ? without_prior : with_prior;
  std::deque<Hypothesis> rivals;
  add_rivals_of_wrong_map(ahead, elapsed_s, rivals, refinement);
  if (!prior_is_wrong) add_excluded(ahead, identified->excluded, refinement);
  exclude_separated_lamp(ahead, refinement, fix.excluded_lamps);
  add_doubt(risk_of_strangers(refinement.poses.front(), scene, blobs, ahead.options.prior),
            refinement);
  fix.choice = refinement.choice;
  fix.timing_s.refine_s = refine_clock.seconds();

  for (const RankedPose& pose : refinement.poses)
    fix.candidates.push_back(candidate_of(pose, blobs, scene));
  take_best(fix);
  take_separation(*refinement.poses.front().refined, scene, options.lamp_fault_probability, fix);
  const double rest = risk_of_rest(identified.value, *refinement.poses.front().hypothesis);
  const double risk = risk_of(refinement);
  fix.risk = risk + (1 - risk) * rest;
  conclude(refinement, scene, options.max_risk, result);
  refuse_unknown_position(*refinement.poses.front().refined, scene, result);
  if (is_excluded(options.prior, fix.cam_from_world))
    add_message("the prior excludes the most probable pose: check the prior", result);
  if (!(fix.risk <= options.max_risk) && result.status != Status::too_few_lamps)
    result.message += suspects(*refinement.poses.front().refined, blobs, scene);
  add_message(internal::scene::colours_not_compared(scene.lamps, blobs), result);
  if (fix.cut_short) add_message(text_of_cut(identified->untried), result);
  attempt.hypotheses = std::move(identified.value.hypotheses);
  return attempt;
}

bool is_located(const Result<Fix>& result) { return rank(result.status) == 0; }

bool has_time(const LocateOptions& options, const Clock& clock) {
  return !options.budget_s || clock.seconds() < 0.5 * *options.budget_s;
}

void name_hidden_sides(Result<Fix>& result) {
  std::string ids;
  for (const auto& [id, blob] : result->lamps)
    if (blob.has_hidden_sides()) ids += " " + std::to_string(id);
  if (!ids.empty())
    add_message(
        "something hides a part of lamps (id" + ids + "): only their visible sides are used",
        result);
}

Result<Fix> locate_blobs(const std::vector<Blob>& blobs, const Scene& scene,
                         const LocateOptions& options, const ImageView* image, const Clock& clock) {
  const auto locate_these = [&](const std::vector<Blob>& these) {
    return locate_as_measured(these, scene, options, image, clock);
  };
  Attempt attempt = locate_these(blobs);
  const bool is_ambiguous = rank(attempt.fix.status) == 1;
  if (is_ambiguous || !scene.has_straight_sides()) return std::move(attempt.fix);
  auto found =
      locate_by_visible_sides(attempt, blobs, scene, options.prior,
                              [&](const std::vector<Blob>& marked) -> std::optional<Attempt> {
                                if (!has_time(options, clock)) return std::nullopt;
                                return locate_these(marked);
                              });
  if (!found) return std::move(attempt.fix);
  name_hidden_sides(*found);
  return *std::move(found);
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

/// True if lamps with straight sides were not located. Their bright parts may then be lamps in
/// several parts, such as the cells of a louvre.
bool may_be_patterned(const Result<Fix>& result, const Scene& scene, const DetectOptions& options) {
  return !is_located(result) && scene.has_straight_sides() && options.rims && !options.patterned;
}

bool is_patterned(const Blob& blob) { return blob.patterned; }

bool has_patterned(const std::vector<Blob>& blobs) {
  return std::any_of(blobs.begin(), blobs.end(), is_patterned);
}

/// True if lamps that state no colour were not located. They may have one that tells them from
/// other lights.
bool may_have_colour(const Result<Fix>& result, const DetectOptions& options) {
  return !is_located(result) && options.colours.empty() && !options.dark;
}

/// Deeper pixels than the sensor's seem to be saturated.
void name_depth(const ImageView& image, const Sensor& sensor, Result<Fix>& result) {
  if (image.type != PixelType::u16) return;
  const int highest = internal::core::highest_level(image);
  if (highest > sensor.full_scale_dn())
    add_message("the image has grey levels up to " + std::to_string(highest) +
                    ": those above the full scale of sensor.bit_depth = " +
                    std::to_string(sensor.bit_depth) + " bits count as saturated",
                result);
}

void name_patterned(Result<Fix>& result) {
  const auto count = std::count_if(result->lamps.begin(), result->lamps.end(),
                                   [](const auto& lamp) { return is_patterned(lamp.second); });
  if (count == 0) return;
  add_message(std::to_string(count) +
                  " of the lamps have bright parts with gaps and are used by the centres of their "
                  "outlines",
              result);
}

}  // namespace

void LocateOptions::validate() const {
  const auto check = [](const std::optional<double>& value, const char* name) {
    if (value) require(*value > 0 && std::isfinite(*value), name, *value, "positive");
  };
  require(max_candidates > 0, "max_candidates", max_candidates, "positive");
  require(max_risk > 0 && max_risk <= 1, "max_risk", max_risk, "above 0 and at most 1");
  require(lamp_fault_probability > 0 && lamp_fault_probability < 1, "lamp_fault_probability",
          lamp_fault_probability, "between 0 and 1");
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
  Scene valid = checked(scene, options);
  valid.sensor = valid.sensor.of_image(image);
  DetectOptions detect_options = detect_options_of(valid, options.detect);
  double detect_s = 0;
  const auto timed = [&](auto&& find) {
    const double start_s = clock.seconds();
    auto found = find();
    detect_s += clock.seconds() - start_s;
    return found;
  };
  const auto detect_with = [&](const DetectOptions& detection) {
    return timed([&] { return detect(image, detection); });
  };
  Result<Fix> result = locate_blobs(detect_with(detect_options), valid, options, &image, clock);
  if (may_have_colour(result, detect_options) && has_time(options, clock)) {
    if (const auto colour = timed([&] { return saturated_colour(image, detect_options); })) {
      Scene coloured = valid;
      for (Lamp& lamp : coloured.lamps) lamp.colour = *colour;
      const auto blobs = detect_with(detect_options_of(coloured, options.detect));
      Result<Fix> found = locate_blobs(blobs, coloured, options, &image, clock);
      if (rank(found.status) < rank(result.status)) {
        found.value.found_colour = colour;
        result = std::move(found);
      }
    }
  }
  if (may_be_patterned(result, valid, detect_options) && has_time(options, clock)) {
    detect_options.patterned = true;
    const std::vector<Blob> joined = detect_with(detect_options);
    if (has_patterned(joined)) {
      Result<Fix> again = locate_blobs(joined, valid, options, &image, clock);
      if (rank(again.status) < rank(result.status)) result = std::move(again);
    }
  }
  result.value.timing_s.detect_s = detect_s;
  if (result->found_colour) add_message(text_of_found_colour(*result->found_colour), result);
  name_patterned(result);
  name_depth(image, valid.sensor, result);
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
