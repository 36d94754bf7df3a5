// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/identify.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/brightness.hpp"
#include "libocc/identify/internal/identify_fields.hpp"
#include "libocc/identify/internal/lamp_table.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/identify/internal/search.hpp"
#include "libocc/identify/internal/search_by_one_lamp.hpp"
#include "libocc/identify/internal/verdict.hpp"
#include "libocc/identify/internal/wrong_sizes.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"

namespace occ {

using namespace internal::identify;
using internal::scene::colours_not_compared;
namespace {

constexpr int max_more_missed =
    3;  // missed lamps beyond those of the best hypothesis; lamps are switched in groups

}  // namespace

void internal::identify::require_finite(const std::vector<Blob>& blobs) {
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    const std::string name = "blobs[" + std::to_string(i) + "].";
    require(blobs[i].centroid_px.allFinite(), name + "centroid_px",
            blobs[i].centroid_px.transpose(), "finite");
    require(blobs[i].covariance_px2.allFinite() && blobs[i].covariance_px2.trace() >= 0,
            name + "covariance_px2", blobs[i].covariance_px2, "finite and not negative");
  }
}

namespace {

Hypothesis to_hypothesis(const AssignmentProblem& problem, const PoseHypothesis& e) {
  Hypothesis h;
  h.cam_from_world = problem.from_world(e.estimate.pose);
  for (const Pair& p : e.pairs)
    h.matches.push_back({p.map_point, problem.observation(p.observation).blob});
  h.matches.insert(h.matches.end(), e.attached.begin(), e.attached.end());
  std::sort(h.matches.begin(), h.matches.end(),
            [](const Match& a, const Match& b) { return a.lamp < b.lamp; });
  h.chi2 = e.chi2;
  h.missed = e.missed;
  h.brightness_chi2 = e.brightness.chi2;
  return h;
}

// True if all lamps are collinear (or at one position), so that no pose can be determined.
bool all_collinear(const AssignmentProblem& problem) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  for (const MapPoint& t : problem.map_points)
    if (t.centre.norm() > axis.norm()) axis = t.centre;
  for (const MapPoint& t : problem.map_points)
    if ((t.centre * axis.squaredNorm() - axis * axis.dot(t.centre)).norm() >
        1e-9 * axis.squaredNorm() * axis.norm())
      return false;
  return true;
}

// Adds the hypotheses that are plausible, or would be with fewer missed lamps. Clears all
// hypotheses and sets the status `degenerate` if the lamps of one are collinear and no prior fixes
// the rotation.
void add_hypotheses(const std::vector<PoseHypothesis>& found, const AssignmentProblem& problem,
                    Result<Identification>& result) {
  const IdentifyOptions& options = *problem.options;
  const bool prior = options.prior && !options.prior->empty();
  for (const PoseHypothesis& e : found) {
    const PoseHypothesis& best = found.front();
    const int more = std::clamp(e.missed - best.missed, 0, max_more_missed);
    if (e.chi2 > best.chi2 + max_hypothesis_delta_chi2 + more * options.miss_penalty) continue;
    result.value.hypotheses.push_back(to_hypothesis(problem, e));
    if (&e != &best) result.value.hypotheses.back().symmetry = find_symmetry(problem, best, e);
    if (prior || !appears_collinear(problem, e.pairs, e.estimate.pose, e.attached)) continue;
    result.value.hypotheses.clear();
    result.status = Status::degenerate;
    result.message =
        "the matched lamps are collinear within the measurement errors: rotations about their line "
        "cannot be distinguished";
    return;
  }
}

// Message of the search. Without hypotheses the status is no_pose.
void set_message(Result<Identification>& result, const AssignmentProblem& problem,
                 const Search& search, bool reflections) {
  std::ostringstream text;
  if (result->hypotheses.empty()) {
    result.status = Status::no_pose;
    text << "no pose matches enough of the " << problem.observations.size() << " blobs to the "
         << problem.map_points.size() << " lamps";
  }
  const auto add = [&]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
  if (reflections)
    add() << "fainter blobs that match other poses are treated as reflections of the lamps";
  if (search.cut_short()) add() << search.limit_reached();
  if (problem.scene) {
    const std::string note = colours_not_compared(problem.scene->lamps, *problem.blobs);
    if (!note.empty()) add() << note;
  }
  result.message = text.str();
}

// Fills the result from the hypotheses of a search.
void fill(const AssignmentProblem& problem, const Search& search, std::vector<PoseHypothesis> found,
          bool reflections, Result<Identification>& result) {
  reflections = drop_reflections(problem, found) > 0 || reflections;
  result.value.chance = search.chance();
  result.value.cut_short = search.cut_short();
  result.value.untried = search.untried();
  result.value.excluded_listed = search.excluded_listed();
  for (const PoseHypothesis& e : search.excluded())
    result.value.excluded.push_back(to_hypothesis(problem, e));
  add_hypotheses(found, problem, result);
  if (result.ok()) set_message(result, problem, search, reflections);
}

// The best hypothesis may match reflections. Then the remaining blobs have a brighter hypothesis.
// Returns true if that is the case, with the result filled from the brighter one. Reflections in
// two mirrors, which keep the handedness of the map, are rare and sought with little effort.
bool fill_from_brighter(const AssignmentProblem& problem, const PoseHypothesis& best,
                        Result<Identification>& result) {
  constexpr int max_hypotheses_of_two_mirrors = 10000;
  std::optional<AssignmentProblem> rest = brighter_remainder(problem, best);
  if (!rest) return false;
  IdentifyOptions options = *problem.options;
  options.max_hypotheses -= result->tried;
  if (!may_match_reflections(problem, best))
    options.max_hypotheses = std::min(options.max_hypotheses, max_hypotheses_of_two_mirrors);
  if (options.max_hypotheses <= 0) return false;
  rest->options = &options;
  Search search(*rest);
  search.run();
  std::vector<PoseHypothesis> found = search.found();
  rank_by_brightness(*rest, found);
  result.value.tried += search.tried();
  if (found.empty() || search.chance() > max_chance ||
      !is_brighter(found.front().brightness, best.brightness))
    return false;
  fill(*rest, search, std::move(found), true, result);
  return true;
}

}  // namespace

void IdentifyOptions::validate() const {
  if (prior) prior->validate();
  require(max_risk > 0 && max_risk <= 1, "max_risk", max_risk, "above 0 and at most 1");
  internal::core::check_fields(*this, identify_fields, "");
}

namespace {

Result<Identification> solve_by_centres(const AssignmentProblem& problem) {
  Result<Identification> result;
  if (problem.observations.size() < 3 || problem.map_points.size() < 3) {
    result.status = Status::too_few_lamps;
    std::ostringstream text;
    text << (problem.scene ? "at least three lamps are needed: the scene has "
                           : "at least three points are needed: the object has ")
         << problem.map_points.size() << ", the image has " << problem.observations.size()
         << " blobs that are neither cut nor merged";
    result.message = text.str();
    return result;
  }
  const bool has_prior = problem.options->prior && !problem.options->prior->empty();
  if (!has_prior && all_collinear(problem)) {
    result.status = Status::degenerate;
    result.message = std::string(problem.scene ? "the scene's lamps" : "the object's points") +
                     " are collinear: rotations about their line cannot be distinguished";
    return result;
  }
  Search search(problem);
  search.run();
  result.value.tried = search.tried();
  std::vector<PoseHypothesis> found = search.found();
  rank_by_brightness(problem, found);
  if (found.empty() || !fill_from_brighter(problem, found.front(), result))
    fill(problem, search, std::move(found), false, result);
  return result;
}

}  // namespace

Result<Identification> internal::identify::solve_assignment(const AssignmentProblem& problem) {
  Result<Identification> result = solve_by_centres(problem);
  if (!result->hypotheses.empty()) return result;
  OneLampPoses one = one_lamp_poses(problem, result.value.cut_short);
  const std::vector<PoseHypothesis>& found = one.hypotheses;
  if (found.empty()) {
    result.value.circles = std::move(one.circles);
    const std::string advice = result.status == Status::no_pose ? advice_on_sizes(problem) : "";
    if (!advice.empty()) result.message += "; " + advice;
    return result;
  }
  result.status = Status::ok;
  result.message = "the pose follows from the outline of one lamp";
  for (const PoseHypothesis& e : found)
    result.value.hypotheses.push_back(to_hypothesis(problem, e));
  return result;
}

std::optional<Hypothesis> internal::identify::hypothesis_at(const AssignmentProblem& problem,
                                                            const std::vector<Match>& matches,
                                                            const Rigid3& cam_from_world) {
  const auto seeds_gate2 = 4 * problem.options->gate_sigma * problem.options->gate_sigma;
  const Rigid3 pose{cam_from_world.rotation, cam_from_world * problem.origin};
  const Eigen::Vector3d camera = pose.origin_in_source();
  PoseHypothesis e;
  for (const Match& match : matches) {
    const MapPoint& map_point = problem.map_point(match.lamp);
    for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
      if (problem.observation(s).blob != match.blob) continue;
      if (!faces(map_point, camera) ||
          !sizes_agree(problem.observation(s), map_point, pose * map_point.centre))
        return std::nullopt;
      e.pairs.push_back({s, match.lamp});
    }
  }
  e.estimate = assess_pose(problem, e.pairs, pose);
  if (prior_chi2(problem, e.estimate) > seeds_gate2) return std::nullopt;
  e.chi2 = e.estimate.chi2;
  account_for_unpaired_lamps(problem, e);
  return to_hypothesis(problem, e);
}

namespace {

void check(const std::vector<Blob>& blobs, const Scene& scene, const IdentifyOptions& options) {
  options.validate();
  require_finite(blobs);
  require(!options.index || options.index->table().is_of(scene.lamps), "index",
          options.index ? options.index->triangles() : 0,
          "of the scene's lamps, positions unchanged");
}

}  // namespace

Result<Identification> internal::identify::search_hypotheses(const std::vector<Blob>& blobs,
                                                             const Scene& scene,
                                                             const IdentifyOptions& options) {
  check(blobs, scene, options);
  return solve_assignment(make_problem(blobs, scene, options));
}

Result<Identification> identify(const std::vector<Blob>& blobs, const Scene& scene,
                                const IdentifyOptions& options) {
  check(blobs, scene, options);
  const AssignmentProblem problem = make_problem(blobs, scene, options);
  Result<Identification> result = solve_assignment(problem);
  conclude(problem, result);
  return result;
}

Result<Identification> identify_object(const std::vector<Blob>& blobs, const Object& object,
                                       const Camera& camera, const IdentifyOptions& options) {
  options.validate();
  require_finite(blobs);
  const AssignmentProblem problem = make_problem(blobs, object, camera, options);
  Result<Identification> result = solve_assignment(problem);
  conclude(problem, result);
  return result;
}

}  // namespace occ
