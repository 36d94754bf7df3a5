// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/identify.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/identify/internal/brightness.hpp"
#include "libocc/identify/internal/identify_fields.hpp"
#include "libocc/identify/internal/lamp_table.hpp"
#include "libocc/identify/internal/line_turns.hpp"
#include "libocc/identify/internal/name_symmetry.hpp"
#include "libocc/identify/internal/search.hpp"
#include "libocc/identify/internal/verdict.hpp"

namespace occ {

using namespace internal::identify;
namespace {

constexpr double plausible_chi2 = 13.8;  // 2 ln 1000
constexpr int more_dark = 3;             // lamps, than of the best: they are switched in groups

}  // namespace

void internal::identify::check(const std::vector<Blob>& blobs) {
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
  for (const Pair& p : e.pairs) h.matches.push_back({p.target, problem.sighting(p.sighting).blob});
  h.matches.insert(h.matches.end(), e.attached.begin(), e.attached.end());
  std::sort(h.matches.begin(), h.matches.end(),
            [](const Match& a, const Match& b) { return a.lamp < b.lamp; });
  h.chi2 = e.chi2;
  h.missed = e.missed;
  h.brightness_chi2 = e.brightness.chi2;
  return h;
}

// Whether all lamps are on one line (or in one place): no pose follows from them.
bool collinear(const AssignmentProblem& problem) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  for (const MapPoint& t : problem.targets)
    if (t.centre.norm() > axis.norm()) axis = t.centre;
  for (const MapPoint& t : problem.targets)
    if ((t.centre * axis.squaredNorm() - axis * axis.dot(t.centre)).norm() >
        1e-9 * axis.squaredNorm() * axis.norm())
      return false;
  return true;
}

// Whether the best explanation leaves blobs unexplained, so that there are false lights, which
// could as well have conspired to it.
bool leaves_blobs(const Identification& found, const AssignmentProblem& problem) {
  std::size_t whole = 0;
  for (const Match& match : found.hypotheses.front().matches)
    whole += std::any_of(problem.sightings.begin(), problem.sightings.end(),
                         [&](const BearingObservation& s) { return s.blob == match.blob; });
  return whole < problem.sightings.size();
}

// Every blob is a lamp and every lamp a blob: the other poses that do as much are the layout's own
// symmetries, which a prior or the brightness has ruled out.
bool is_all_there_is(const Identification& found, const AssignmentProblem& problem) {
  return !leaves_blobs(found, problem) &&
         found.hypotheses.front().matches.size() == problem.targets.size();
}

// The hypotheses, all of them plausible or with more dark lamps than the best; none where a turn
// about a line of lamps is open and no prior closes it.
void list(const std::vector<PoseHypothesis>& found, const AssignmentProblem& problem,
          Result<Identification>& result) {
  const IdentifyOptions& options = *problem.options;
  const bool prior = options.prior && !options.prior->empty();
  for (const PoseHypothesis& e : found) {
    const PoseHypothesis& best = found.front();
    const int more = std::clamp(e.missed - best.missed, 0, more_dark);
    if (e.chi2 > best.chi2 + plausible_chi2 + more * options.miss_penalty) continue;
    result.value.hypotheses.push_back(to_hypothesis(problem, e));
    if (&e != &best) result.value.hypotheses.back().symmetry = name_symmetry(problem, best, e);
    if (prior || !on_a_line(problem, e.pairs, e.estimate.pose, e.attached)) continue;
    result.value.hypotheses.clear();
    result.status = Status::degenerate;
    result.message =
        "as far as can be seen the lamps are on one line: a pose cannot be told from its turns "
        "about it";
    return;
  }
}

// How the map repeats, of the plausible ones.
void say_symmetries(const std::vector<Hypothesis>& hypotheses, std::size_t count,
                    std::ostream& text) {
  constexpr std::size_t most = 3;
  std::size_t said = 0, repeats = 0;
  for (std::size_t i = 1; i < count; ++i) {
    if (hypotheses[i].symmetry->kind == SymmetryKind::none || ++repeats > most) continue;
    text << (said++ == 0 ? ": " : "; ") << hypotheses[i].symmetry->text;
  }
  if (repeats > most) text << "; and " << repeats - most << " more";
}

void judge(Result<Identification>& result, const AssignmentProblem& problem, const Search& search,
           bool reflections) {
  const std::vector<Hypothesis>& hypotheses = result->hypotheses;
  const auto count = std::count_if(hypotheses.begin(), hypotheses.end(), [&](const Hypothesis& h) {
    return h.chi2 <= hypotheses.front().chi2 + plausible_chi2;
  });
  std::ostringstream text;
  if (count == 0) {
    result.status = Status::no_pose;
    text << "no pose explains enough of the " << problem.sightings.size() << " blobs by the "
         << problem.targets.size() << " lamps";
  } else if (count > 1) {
    result.status = Status::ambiguous;
    text << count << " poses explain the same number of blobs about equally well";
    say_symmetries(hypotheses, static_cast<std::size_t>(count), text);
  } else if (!is_all_there_is(*result, problem) &&
             result->chance > (hypotheses.front().missed > 0 ? unlikely_if_missing : unlikely)) {
    result.value.may_be_chance = true;
    result.status = Status::ambiguous;
    text << "the one pose found may be chance: " << result->chance
         << " wrong ones are expected to explain as many blobs";
  } else if (leaves_blobs(*result, problem) && !search.best_fits()) {
    result.value.may_be_chance = true;
    result.status = Status::ambiguous;
    text << "the one pose found leaves blobs unexplained and fits worse than 99.9 % of right ones";
  }
  const auto add = [&]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
  if (reflections)
    add() << "fainter blobs that other poses explain are taken for reflections of the lamps";
  if (search.cut_short())
    add() << "the search stopped after max_hypotheses = " << problem.options->max_hypotheses;
  result.message = text.str();
}

// The verdict on what a search has found.
void answer(const AssignmentProblem& problem, const Search& search,
            std::vector<PoseHypothesis> found, bool reflections, Result<Identification>& result) {
  reflections = drop_reflections(problem, found) > 0 || reflections;
  result.value.chance = search.chance();
  list(found, problem, result);
  if (result.ok()) judge(result, problem, search, reflections);
}

// The best explanation may be one of reflections: then what it leaves has a brighter one. True when
// that is the answer.
bool answer_by_brighter(const AssignmentProblem& problem, const PoseHypothesis& best,
                        Result<Identification>& result) {
  const std::optional<AssignmentProblem> rest = brighter_rest(problem, best);
  if (!rest) return false;
  Search search(*rest);
  search.run();
  std::vector<PoseHypothesis> found = search.found();
  weigh_by_brightness(*rest, found);
  result.value.tried += search.tried();
  if (found.empty() || search.chance() > unlikely ||
      !outshines(found.front().brightness, best.brightness))
    return false;
  answer(*rest, search, std::move(found), true, result);
  return true;
}

}  // namespace

void IdentifyOptions::validate() const {
  if (prior) prior->validate();
  internal::core::check_fields(*this, identify_fields, "");
}

Result<Identification> internal::identify::verdict(const AssignmentProblem& problem) {
  Result<Identification> result;
  if (problem.sightings.size() < 3 || problem.targets.size() < 3) {
    result.status = Status::too_few_lamps;
    std::ostringstream text;
    text << (problem.scene ? "three lamps are needed: the scene has "
                           : "three points are needed: the object has ")
         << problem.targets.size() << ", the image " << problem.sightings.size()
         << " blobs that are whole";
    result.message = text.str();
    return result;
  }
  if (collinear(problem)) {
    result.status = Status::degenerate;
    result.message = std::string(problem.scene ? "the scene's lamps" : "the object's points") +
                     " are on one line: a pose cannot be told from its turns about it";
    return result;
  }
  Search search(problem);
  search.run();
  result.value.tried = search.tried();
  std::vector<PoseHypothesis> found = search.found();
  weigh_by_brightness(problem, found);
  if (found.empty() || !answer_by_brighter(problem, found.front(), result))
    answer(problem, search, std::move(found), false, result);
  return result;
}

Result<Identification> identify(const std::vector<Blob>& blobs, const Scene& scene,
                                const IdentifyOptions& options) {
  options.validate();
  check(blobs);
  require(!options.index || options.index->table().is_of(scene.lamps), "index",
          options.index ? options.index->triangles() : 0, "of the scene's lamps, places unchanged");
  return verdict(make_problem(blobs, scene, options));
}

Result<Identification> identify_object(const std::vector<Blob>& blobs, const Object& object,
                                       const Camera& camera, const IdentifyOptions& options) {
  options.validate();
  check(blobs);
  return verdict(make_problem(blobs, object, camera, options));
}

}  // namespace occ
