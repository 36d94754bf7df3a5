// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/search.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/last_pose.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ::internal::identify {
namespace {

constexpr std::size_t max_kept = 64;  // hypotheses; more than these are ambiguous in any case
// Tolerance of P3P near a double root: noise makes the roots complex, and their real part has a
// larger error than the noise.
constexpr double kneip_tolerance_rad = 0.1;
constexpr int support_of_four = 7;  // support of three coded pairs and one uncoded pair
constexpr double same_pose_chi2 =
    9;  // squared distance in sigmas below which two poses are the same

// True if verifying every assignment would take long. All assignments of three blobs fit some pose;
// those of outlines are compared by them.
bool has_many_assignments(const AssignmentProblem& problem) {
  const auto& blobs = problem.observations;
  const auto coded = std::count_if(blobs.begin(), blobs.end(),
                                   [](const BearingObservation& s) { return s.coded; });
  const bool have_outlines =
      std::all_of(blobs.begin(), blobs.end(), [&](const BearingObservation& s) {
        const Blob& blob = (*problem.blobs)[static_cast<std::size_t>(s.blob)];
        return !blob.rim.empty() && !blob.has_elliptical_rim();
      });
  const std::size_t min_blobs = have_outlines ? 3 : 4;
  return problem.map_points.size() >= min_lamps_of_a_search && blobs.size() >= min_blobs &&
         coded < 2;
}

}  // namespace

bool agrees_with_prior(const AssignmentProblem& problem, const PoseHypothesis& e) {
  const std::optional<Prior>& prior = problem.options->prior;
  return !prior || prior->chi2(problem.from_world(e.estimate.pose)) <= max_prior_chi2;
}

// The factor of 2 accounts for the covariance of a well-determined pose.
double gate_share(const AssignmentProblem& problem) {
  const Camera& camera = *problem.camera;
  const double image = camera.width() * camera.height() / (camera.fx_px() * camera.fy_px());
  double ellipses = 0;
  for (const BearingObservation& s : problem.observations)
    ellipses += std::sqrt(s.covariance.determinant());
  const double gate = problem.options->gate_sigma;
  return 2 * pi * gate * gate * ellipses /
         (static_cast<double>(problem.observations.size()) * image);
}

bool appearance_agrees(const AssignmentProblem& problem, const Assignment& assignment,
                       const Rigid3& pose) {
  const Eigen::Vector3d camera = pose.origin_in_source();
  return std::all_of(assignment.begin(), assignment.end(), [&](const Pair& p) {
    const MapPoint& map_point = problem.map_point(p.map_point);
    return faces(map_point, camera) &&
           sizes_agree(problem.observation(p.observation), map_point, pose * map_point.centre);
  });
}

Search::Search(const AssignmentProblem& problem)
    : problem_(problem), covisibility_(problem), sizes_(problem), outlines_(problem) {
  prior_ = problem.options->prior && !problem.options->prior->empty();
}

void Search::run() {
  IdentifyMethod method = problem_.options->method;
  const bool automatic = method == IdentifyMethod::automatic;
  if (automatic)
    method = !has_many_assignments(problem_) ? IdentifyMethod::alignment
             : problem_.options->index       ? IdentifyMethod::hashing
                                             : IdentifyMethod::voting;
  if (!automatic || (!search_near_last_pose() && !search_lamp_like(method))) search_by(method);
  if (automatic && statistics_ && !cut_short_) add_row();
  merge_and_rank();
  const bool last_pose = prior_ && problem_.options->prior->last_pose;
  // In a regular map a moved pose may match some of the blobs that the best pose leaves.
  const bool leaves_blobs =
      !found_.empty() && found_.front().pairs.size() < problem_.observations.size();
  // With fewer pairs, a rival needs as many as the best (fewer_pairs), and rounding may cost it
  // one.
  // A large map takes long: the time grows with the square of the number of lamps.
  constexpr std::size_t max_lamps = 256;
  const bool is_weak = !found_.empty() && found_.front().pairs.size() < strong_pairs &&
                       problem_.map_points.size() <= max_lamps;
  const bool may_be_elsewhere = cut_short_ || last_pose || leaves_blobs;
  if (may_be_elsewhere || is_weak) add_moved_poses(may_be_elsewhere);
  if (prior_) add_poses_elsewhere();
  penalise_fewer_pairs();
}

void Search::search_by(IdentifyMethod method) {
  switch (method) {
    case IdentifyMethod::hashing:
      search_by_hashing();
      break;
    case IdentifyMethod::voting:
      search_by_voting();
      break;
    case IdentifyMethod::ransac:
      search_by_sampling();
      break;
    case IdentifyMethod::clustering:
      search_by_clustering();
      break;
    default:
      search_by_alignment();
  }
}

// Votes need groups of lamps that determine a pose. A row of lamps does not, or not well.
void Search::add_row() {
  constexpr std::size_t max_lamps = 128;  // all triples of them are looked at
  if (problem_.map_points.size() > max_lamps || !appear_as_row(problem_)) return;
  Search row(problem_);
  row.row_ = true;
  row.search_by_alignment();
  cut_short_ = row.cut_short_;
  for (PoseHypothesis& hypothesis : row.found_) {
    hypothesis.poses_scored = statistics_->poses;
    found_.push_back(std::move(hypothesis));
  }
}

void Search::search_by_alignment() {
  TripleOrder order(problem_);
  groups_in_all_ = order.groups();
  while (const auto triple = order.next(max_outliers())) {
    try_triple(*triple);
    if (cut_short_) break;
    ++groups_;
  }
}

// Reads the clock at every sixteenth pose, because a pose takes less than a microsecond.
bool Search::tried_enough() const {
  return tried_ >= problem_.options->max_hypotheses || (tried_ % 16 == 0 && problem_.out_of_time());
}

std::string Search::limit_reached() const {
  std::ostringstream text;
  if (!cut_short_) {
    text << "without the prior, " << limit_elsewhere_;
    return text.str();
  }
  text << "the search stopped after ";
  if (tried_ >= problem_.options->max_hypotheses)
    text << "max_hypotheses = " << problem_.options->max_hypotheses;
  else
    text << "max_time_s = " << problem_.options->max_time_s;
  text << ", with " << std::ceil(100 * untried()) << " % of the groups of blobs untried";
  return text.str();
}

double Search::untried() const {
  if (!cut_short_) return 0;
  if (groups_in_all_ == 0) return 1;
  return std::max(1, groups_in_all_ - groups_) / static_cast<double>(groups_in_all_);
}

// A strong hypothesis is unlikely to have a rival by chance. But where it leaves blobs and misses
// lamps, another pose may match both: a regular map agrees with itself after a shift. Where it
// leaves blobs and may be accidental, they may be the lamps.
bool Search::best_is_strong() const { return best_support_ >= strong_pairs && best_is_complete_; }

// Returns the maximum number of outliers in a hypothesis worth finding; at most two beside a strong
// hypothesis.
int Search::max_outliers() const {
  const auto& blobs = problem_.observations;
  const int coded = static_cast<int>(std::count_if(
      blobs.begin(), blobs.end(), [](const BearingObservation& s) { return s.coded; }));
  const int sought = std::max({best_support_ - coded, problem_.min_pairs, 3});
  const int unexplained = std::max(static_cast<int>(blobs.size()) - sought, 0);
  return best_is_strong() ? std::min(unexplained, 2) : unexplained;
}

// Number of pairs; coded pairs count twice.
int Search::support(const std::vector<Pair>& pairs) const {
  return static_cast<int>(pairs.size()) + coded_pairs(pairs);
}

// Three blobs fit some pose for any assignment. Three pairs count only if they are coded, supported
// by a prior, or the only blobs.
bool Search::has_enough_support(const Assignment& assignment,
                                const std::vector<Pair>& pairs) const {
  const bool coded = coded_pairs({assignment.begin(), assignment.end()}) == 3;
  const std::size_t enough = coded || prior_ || problem_.observations.size() == 3 ? 3 : 4;
  if (pairs.size() < std::max(enough, static_cast<std::size_t>(problem_.min_pairs))) return false;
  return support(pairs) >= best_support_ - fewer_pairs() ||
         (coded && best_support_ <= support_of_four);
}

int Search::coded_pairs(const std::vector<Pair>& pairs) const {
  return static_cast<int>(std::count_if(pairs.begin(), pairs.end(), [&](const Pair& p) {
    return problem_.observation(p.observation).coded;
  }));
}

// A rival may have a few pairs less: by accident the best has one more, as a wrong pose of a
// regular map that misses many lamps, or one of its blobs is just outside the gate.
int Search::fewer_pairs() const {
  constexpr int one_of = 6;
  return best_support_ / one_of;
}

// Chi-square that one more pair outweighs: twice ln of its likelihood over that of a false light.
double Search::chi2_of_pair() const {
  constexpr double min_chi2 = 6;
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  const double false_lights =
      gate_share(problem_) / gate2 *
      static_cast<double>(std::max<std::size_t>(1, problem_.observations.size()));
  return std::max(min_chi2, -2 * std::log(false_lights));
}

// A fourth, uncoded pair may be accidental, because three pairs determine a pose poorly.
bool Search::has_similar_support(const PoseHypothesis& e, const PoseHypothesis& most) const {
  return support(e.pairs) >= support(most.pairs) - fewer_pairs() ||
         (most.pairs.size() == 4 && coded_pairs(e.pairs) == 3 && coded_pairs(most.pairs) == 3);
}

void Search::try_triple(const BlobTriple& triple) {
  Assignment assignment;
  for (std::size_t i = 0; i < 3; ++i) assignment[i].observation = triple.observations[i];
  for (const int a : problem_.observation(triple.observations[0]).lamps)
    for (const int b : problem_.observation(triple.observations[1]).lamps) {
      if (a == b || !sizes_.permits({triple.observations[0], a}, {triple.observations[1], b}))
        continue;
      for (const int c : problem_.observation(triple.observations[2]).lamps) {
        if (b == c || c == a || !covisibility_.triple(a, b, c)) continue;
        if (row_ && !are_a_row(problem_, a, b, c)) continue;
        if (tried_enough()) {
          cut_short_ = true;
          return;
        }
        ++tried_;
        assignment[0].map_point = a;
        assignment[1].map_point = b;
        assignment[2].map_point = c;
        if (!sizes_.permits(assignment[0], assignment[2]) ||
            !sizes_.permits(assignment[1], assignment[2]) || contradicts_orientation(assignment))
          continue;
        for (const FittedPose& seed : candidates_from(assignment)) consider(seed, assignment);
      }
    }
}

// Expected number of wrong poses for three pairs that only the prior supports. Counts the poses
// that would agree with a weaker prior, scaled by the ratio of the gate volumes, weaker^(-dof/2).
// The maximum over several factors is used.
double Search::chance_of_prior(const std::vector<Pair>& best) const {
  if (coded_pairs(best) == 3) return 0;
  const int dof = std::min(problem_.options->prior->dof(), 6);
  double expected = 0;
  for (const double weaker : {4.0, 16.0, 64.0, 256.0}) {
    const auto agree = std::count_if(prior_chi2_of_seeds_.begin(), prior_chi2_of_seeds_.end(),
                                     [&](double chi2) { return chi2 <= weaker * max_prior_chi2; });
    const double others = static_cast<double>(agree) - static_cast<double>(found_.size());
    expected = std::max(expected, others * std::pow(weaker, -0.5 * dof));
  }
  return expected;
}

// Expected number of wrong hypotheses by a Poisson model.
//
// Four pairs: number of poses with a fourth pair that do not belong to the best hypothesis (counted
// once for each of its triples, hence an upper bound), at least the number that the poses tried
// make likely. Further pairs: the pose is then well determined, so each has the probability of the
// image share of its gate. Seeds with too few coded pairs to reach the best hypothesis are not
// counted.
double Search::chance() const {
  if (statistics_) return found_.empty() ? 0 : chance_of(found_.front());
  constexpr double gate_of_three =
      5;  // typical area of the gate of a pose from three pairs, relative to a well-determined pose
  if (found_.empty()) return 0;
  const std::vector<Pair>& best = found_.front().pairs;
  if (best.size() == 3) return prior_ ? chance_of_prior(best) : 0;
  const int coded = coded_pairs(best), size = static_cast<int>(best.size());
  double poses = 0, chance_matches = 0;
  for (const Seed& seed : seeds_) {
    const std::vector<Pair> assignment(seed.assignment.begin(), seed.assignment.end());
    if (std::all_of(assignment.begin(), assignment.end(),
                    [&](const Pair& p) { return contains(best, p); }))
      continue;
    if (coded_pairs(assignment) >= coded - (size - 3)) poses += 1;
    if (seed.coded >= coded - (size - 4)) chance_matches += seed.further;
  }
  const auto one_more = [&](int pairs) {
    return static_cast<double>(static_cast<int>(problem_.map_points.size()) - pairs) *
           static_cast<double>(static_cast<int>(problem_.observations.size()) - pairs) *
           gate_share(problem_);
  };
  double expected = std::max(chance_matches, poses * one_more(3) * gate_of_three);
  for (int pairs = 4; pairs < size; ++pairs) expected *= one_more(pairs) / (pairs - 2);
  return expected;
}

// Coplanar lamps that face the same side are visible from that side only. Three of them therefore
// have a fixed orientation (clockwise or not) in the image, which excludes half of all assignments.
bool Search::contradicts_orientation(const Assignment& assignment) const {
  const MapPoint &a = problem_.map_point(assignment[0].map_point),
                 &b = problem_.map_point(assignment[1].map_point),
                 &c = problem_.map_point(assignment[2].map_point);
  const Eigen::Vector3d across = (b.centre - a.centre).cross(c.centre - a.centre);
  const double facing = across.dot(a.normal);
  const double flat = (1 - 1e-9) * across.norm();
  if (a.cone_cos < 0 || std::abs(facing) < flat || std::abs(across.dot(b.normal)) < flat ||
      std::abs(across.dot(c.normal)) < flat || a.normal.dot(b.normal) < 0 ||
      a.normal.dot(c.normal) < 0)
    return false;
  const BearingObservation &i = problem_.observation(assignment[0].observation),
                           &j = problem_.observation(assignment[1].observation),
                           &k = problem_.observation(assignment[2].observation);
  const Eigen::Vector3d ij = j.bearing - i.bearing, ik = k.bearing - i.bearing;
  const double volume = i.bearing.dot(ij.cross(ik));
  const double noise = problem_.options->gate_sigma * (i.sigma_rad + j.sigma_rad + k.sigma_rad) *
                       std::max(ij.norm(), ik.norm());
  return std::abs(volume) > noise && (volume > 0) == (facing > 0);
}

// Returns the poses that fit the three pairs within the gate.
std::vector<FittedPose> Search::candidates_from(const Assignment& assignment) const {
  Eigen::Matrix3d bearings, points;
  for (int i = 0; i < 3; ++i) {
    const Pair& pair = assignment[i];
    bearings.col(i) = problem_.observation(pair.observation).bearing;
    points.col(i) = problem_.map_point(pair.map_point).centre;
  }
  std::array<Rigid3, 4> poses;
  const int count = p3p_within(bearings, off_their_line(points), kneip_tolerance_rad, poses);
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  const std::vector<Pair> triple(assignment.begin(), assignment.end());
  std::vector<FittedPose> seeds;
  const auto add = [&](const Rigid3& pose) {
    if (!appearance_agrees(problem_, assignment, pose)) return;
    FittedPose seed = assess_pose(problem_, triple, pose);
    if (seed.chi2 > gate2) seed = fit_pose(problem_, triple, pose);
    if (seed.chi2 <= gate2) seeds.push_back(seed);
  };
  const bool may_turn = prior_ || are_a_row(problem_, assignment[0].map_point,
                                            assignment[1].map_point, assignment[2].map_point);
  for (int i = 0; i < count; ++i) {
    add(poses[i]);
    if (!may_turn || !appears_collinear(problem_, triple, poses[i])) continue;
    for (const Rigid3& rotated : rotations_about_line(problem_, assignment, poses[i])) {
      if (!prior_ && !seeds.empty()) break;  // one stands for all
      add(rotated);
    }
  }
  return seeds;
}

void Search::consider(const FittedPose& seed, const Assignment& assignment) {
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  if (prior_) {
    const double chi2 = prior_chi2(problem_, seed);
    if (!statistics_) prior_chi2_of_seeds_.push_back(chi2);
    if (chi2 > 4 * gate2) return;
  }
  const std::vector<ScoredPair> further = additional_pairs(problem_, seed, assignment);
  std::vector<Pair> pairs = one_to_one(further);
  const int more = static_cast<int>(pairs.size());
  pairs.insert(pairs.end(), assignment.begin(), assignment.end());
  seeds_.push_back({assignment, more, coded_pairs(pairs)});
  if (!has_enough_support(assignment, pairs)) return;
  PoseHypothesis hypothesis = verify_hypothesis(problem_, seed, assignment, further);
  if (has_enough_support(assignment, hypothesis.pairs) && agrees_with_prior(problem_, hypothesis))
    keep(std::move(hypothesis));
}

void Search::keep(PoseHypothesis hypothesis) {
  for (const PoseHypothesis& known : found_)
    if (same_pairs(known.pairs, hypothesis.pairs) &&
        squared_sigmas(hypothesis.estimate.pose, known.estimate) < same_pose_chi2)
      return;
  account_for_unpaired_lamps(problem_, hypothesis);
  hypothesis.outline_misfit = outlines_.of(hypothesis);
  if (statistics_) hypothesis.poses_scored = statistics_->poses;
  if ((statistics_ || by_last_pose_) && misses_too_many(hypothesis)) return;
  const double chance = statistics_ ? chance_of(hypothesis) : 0;
  if ((!statistics_ || (chance < max_chance && fits(hypothesis))) &&
      support(hypothesis.pairs) >= best_support_) {
    const bool complete = hypothesis.pairs.size() == problem_.observations.size() ||
                          (hypothesis.missed == 0 && chance < max_chance_if_leaving);
    best_is_complete_ =
        complete || (best_is_complete_ && support(hypothesis.pairs) == best_support_);
    best_support_ = support(hypothesis.pairs);
  }
  found_.push_back(std::move(hypothesis));
  if (found_.size() >= 4 * max_kept) merge_and_rank();
}

void Search::merge_and_rank() {
  if (found_.empty()) return;
  const PoseHypothesis most = *std::max_element(
      found_.begin(), found_.end(), [&](const PoseHypothesis& a, const PoseHypothesis& b) {
        return support(a.pairs) < support(b.pairs);
      });
  const double of_pair = chi2_of_pair();
  const auto cost = [&](const PoseHypothesis& e) {
    return e.chi2 + e.outline_misfit - of_pair * support(e.pairs);
  };
  std::stable_sort(
      found_.begin(), found_.end(),
      [&](const PoseHypothesis& a, const PoseHypothesis& b) { return cost(a) < cost(b); });
  std::vector<PoseHypothesis> distinct;
  for (const PoseHypothesis& e : found_) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const PoseHypothesis& d) {
      return same_pairs(e.pairs, d.pairs) &&
             squared_sigmas(e.estimate.pose, d.estimate) < same_pose_chi2;
    });
    if (!known && has_similar_support(e, most) && distinct.size() < max_kept) distinct.push_back(e);
  }
  found_ = std::move(distinct);
}

// Adds to each hypothesis the chi-square of the pairs that it has less than the largest support.
void Search::penalise_fewer_pairs() {
  int most = 0;
  for (const PoseHypothesis& e : found_) most = std::max(most, support(e.pairs));
  for (PoseHypothesis& e : found_) e.chi2 += chi2_of_pair() * (most - support(e.pairs));
}

}  // namespace occ::internal::identify
