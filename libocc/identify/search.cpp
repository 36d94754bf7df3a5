// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/search.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/line_turns.hpp"
#include "libocc/identify/internal/visibility.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ::internal::identify {
namespace {

constexpr std::size_t max_kept = 64;  // explanations; with more the answer is "cannot tell" anyway
// Near a double root noise makes the roots complex, and their real part is off by more than the
// noise.
constexpr double kneip_tolerance_rad = 0.1;
constexpr int worth_of_four = 7;           // of three named pairs and one without a name
constexpr double same_pose_chi2 = 9;       // poses nearer than this in their own sigmas are one
constexpr double largest_prior_chi2 = 36;  // six sigma

double squared_sigmas(const Rigid3& a, const FittedPose& b) {
  const Vector6 delta = difference(a, b.pose);
  return delta.dot(b.covariance.llt().solve(delta));
}

bool believable(const AssignmentProblem& problem, const PoseHypothesis& e) {
  const std::optional<Prior>& prior = problem.options->prior;
  return !prior || prior->chi2(problem.from_world(e.estimate.pose)) <= largest_prior_chi2;
}

// Whether so many namings are possible that looking at each would take long.
bool wide(const AssignmentProblem& problem) {
  constexpr std::size_t few = 7;
  const auto named = std::count_if(problem.sightings.begin(), problem.sightings.end(),
                                   [](const BearingObservation& s) { return s.named; });
  return problem.targets.size() >= few && problem.sightings.size() >= 4 && named < 2;
}

}  // namespace

// Share of the image that one blob's gate covers, that of a firm pose's own error included.
double gate_share(const AssignmentProblem& problem) {
  const Camera& camera = *problem.camera;
  const double image = camera.width() * camera.height() / (camera.fx_px() * camera.fy_px());
  double ellipses = 0;
  for (const BearingObservation& s : problem.sightings)
    ellipses += std::sqrt(s.covariance.determinant());
  const double gate = problem.options->gate_sigma;
  return 2 * pi * gate * gate * ellipses / (static_cast<double>(problem.sightings.size()) * image);
}

// Whether the three lamps would look as they do, apart from their place: lit side, size.
bool looks_right(const AssignmentProblem& problem, const Naming& naming, const Rigid3& pose) {
  const Eigen::Vector3d camera = pose.origin_in_source();
  return std::all_of(naming.begin(), naming.end(), [&](const Pair& p) {
    const MapPoint& target = problem.target(p.target);
    return faces(target, camera) &&
           sizes_agree(problem.sighting(p.sighting), target, pose * target.centre);
  });
}

Search::Search(const AssignmentProblem& problem) : problem_(problem), together_(problem) {
  prior_ = problem.options->prior && !problem.options->prior->empty();
}

void Search::run() {
  IdentifyMethod method = problem_.options->method;
  if (method == IdentifyMethod::automatic)
    method = !wide(problem_)           ? IdentifyMethod::alignment
             : problem_.options->index ? IdentifyMethod::hashing
                                       : IdentifyMethod::voting;
  switch (method) {
    case IdentifyMethod::hashing:
      hash();
      break;
    case IdentifyMethod::voting:
      vote();
      break;
    case IdentifyMethod::ransac:
      sample();
      break;
    case IdentifyMethod::clustering:
      cluster();
      break;
    default:
      try_all();
  }
  merge_and_rank();
}

void Search::try_all() {
  TripleOrder order(problem_);
  while (const auto triple = order.next(false_lights())) {
    try_triple(*triple);
    if (cut_short_) break;
  }
}

// How many of the blobs may be false in an explanation worth finding. A strong one can hardly be
// rivalled by chance, so few alternatives need ruling out.
int Search::false_lights() const {
  const auto& blobs = problem_.sightings;
  const int named = static_cast<int>(std::count_if(
      blobs.begin(), blobs.end(), [](const BearingObservation& s) { return s.named; }));
  const int sought = std::max({most_ - named, problem_.min_pairs, 3});
  const int unexplained = std::max(static_cast<int>(blobs.size()) - sought, 0);
  return most_ >= strong ? std::min(unexplained, 2) : unexplained;
}

// What an explanation is worth: its pairs, those with a name twice.
int Search::worth(const std::vector<Pair>& pairs) const {
  return static_cast<int>(pairs.size()) + named_pairs(pairs);
}

// Any three blobs fit some pose: three of more say nothing unless named or backed by a prior.
bool Search::worth_keeping(const Naming& naming, const std::vector<Pair>& pairs) const {
  const bool named = named_pairs({naming.begin(), naming.end()}) == 3;
  const std::size_t enough = named || prior_ || problem_.sightings.size() == 3 ? 3 : 4;
  if (pairs.size() < std::max(enough, static_cast<std::size_t>(problem_.min_pairs))) return false;
  return worth(pairs) >= most_ || (named && most_ <= worth_of_four);
}

int Search::named_pairs(const std::vector<Pair>& pairs) const {
  return static_cast<int>(std::count_if(pairs.begin(), pairs.end(), [&](const Pair& p) {
    return problem_.sighting(p.sighting).named;
  }));
}

// Whether an explanation is worth as much as the first one. A fourth pair that has no name is
// easily an accident, because three determine a pose but poorly.
bool Search::rivals(const PoseHypothesis& e) const {
  const std::vector<Pair>& best = found_.front().pairs;
  return worth(e.pairs) == worth(best) ||
         (best.size() == 4 && named_pairs(e.pairs) == 3 && named_pairs(best) == 3);
}

void Search::try_triple(const BlobTriple& triple) {
  Naming naming;
  for (std::size_t i = 0; i < 3; ++i) naming[i].sighting = triple.sightings[i];
  for (const int a : problem_.sighting(triple.sightings[0]).lamps)
    for (const int b : problem_.sighting(triple.sightings[1]).lamps)
      for (const int c : problem_.sighting(triple.sightings[2]).lamps) {
        if (a == b || b == c || c == a || !together_.triple(a, b, c)) continue;
        if (tried_ == problem_.options->max_hypotheses) {
          cut_short_ = true;
          return;
        }
        ++tried_;
        naming[0].target = a;
        naming[1].target = b;
        naming[2].target = c;
        if (contradicts_view(naming)) continue;
        for (const FittedPose& seed : seeds_of(naming)) consider(seed, naming);
      }
}

// Three pairs make a pose, and only the prior speaks for it. How many other poses of three agree
// with the prior by accident: from those that agree with it if it were weaker, as many fewer as the
// volume within its gate is smaller.
double Search::chance_of_prior(const std::vector<Pair>& best) const {
  if (named_pairs(best) == 3) return 0;
  const int dof = std::min(problem_.options->prior->dof(), 6);
  double expected = 0;
  for (const double weaker : {4.0, 16.0, 64.0, 256.0}) {
    const auto agree =
        std::count_if(prior_chi2_of_seeds_.begin(), prior_chi2_of_seeds_.end(),
                      [&](double chi2) { return chi2 <= weaker * largest_prior_chi2; });
    const double others = static_cast<double>(agree) - static_cast<double>(found_.size());
    expected = std::max(expected, others * std::pow(weaker, -0.5 * dof));
  }
  return expected;
}

// Accidents with four pairs are counted: poses that gather a fourth and do not belong to the best
// explanation (once for each of its triples, so this is an upper bound), but no fewer than the
// poses tried make likely. Four pairs make a pose firm: each further one then comes with the share
// of the image that its gate covers. What has too few names cannot become as good as the best.
double Search::chance() const {
  if (turnout_) return found_.empty() ? 0 : chance_of(found_.front());
  constexpr double gate_of_three = 5;  // typically, over that of a firm pose
  if (found_.empty()) return 0;
  const std::vector<Pair>& best = found_.front().pairs;
  if (best.size() == 3) return prior_ ? chance_of_prior(best) : 0;
  const int named = named_pairs(best), size = static_cast<int>(best.size());
  double poses = 0, accidents = 0;
  for (const Seed& seed : seeds_) {
    const std::vector<Pair> naming(seed.naming.begin(), seed.naming.end());
    if (std::all_of(naming.begin(), naming.end(), [&](const Pair& p) { return contains(best, p); }))
      continue;
    if (named_pairs(naming) >= named - (size - 3)) poses += 1;
    if (seed.named >= named - (size - 4)) accidents += seed.further;
  }
  const auto one_more = [&](int pairs) {
    return static_cast<double>(static_cast<int>(problem_.targets.size()) - pairs) *
           static_cast<double>(static_cast<int>(problem_.sightings.size()) - pairs) *
           gate_share(problem_);
  };
  double expected = std::max(accidents, poses * one_more(3) * gate_of_three);
  for (int pairs = 4; pairs < size; ++pairs) expected *= one_more(pairs) / (pairs - 2);
  return expected;
}

// Lamps in one plane that face the same side are seen from that side only, so three of them run the
// same way round in the image: half of all namings fall without a pose.
bool Search::contradicts_view(const Naming& naming) const {
  const MapPoint &a = problem_.target(naming[0].target), &b = problem_.target(naming[1].target),
                 &c = problem_.target(naming[2].target);
  const Eigen::Vector3d across = (b.centre - a.centre).cross(c.centre - a.centre);
  const double facing = across.dot(a.normal);
  const double flat = (1 - 1e-9) * across.norm();
  if (a.cone_cos < 0 || std::abs(facing) < flat || std::abs(across.dot(b.normal)) < flat ||
      std::abs(across.dot(c.normal)) < flat || a.normal.dot(b.normal) < 0 ||
      a.normal.dot(c.normal) < 0)
    return false;
  const BearingObservation &i = problem_.sighting(naming[0].sighting),
                           &j = problem_.sighting(naming[1].sighting),
                           &k = problem_.sighting(naming[2].sighting);
  const Eigen::Vector3d ij = j.bearing - i.bearing, ik = k.bearing - i.bearing;
  const double turn = i.bearing.dot(ij.cross(ik));
  const double noise = problem_.options->gate_sigma * (i.sigma_rad + j.sigma_rad + k.sigma_rad) *
                       std::max(ij.norm(), ik.norm());
  return std::abs(turn) > noise && (turn > 0) == (facing > 0);
}

// Poses from which the three lamps look as they do within the noise.
std::vector<FittedPose> Search::seeds_of(const Naming& naming) const {
  Eigen::Matrix3d bearings, points;
  for (int i = 0; i < 3; ++i) {
    const Pair& pair = naming[i];
    bearings.col(i) = problem_.sighting(pair.sighting).bearing;
    points.col(i) = problem_.target(pair.target).centre;
  }
  std::array<Rigid3, 4> poses;
  const int count = p3p_within(bearings, points, kneip_tolerance_rad, poses);
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  const std::vector<Pair> triple(naming.begin(), naming.end());
  std::vector<FittedPose> seeds;
  const auto add = [&](const Rigid3& pose) {
    if (!looks_right(problem_, naming, pose)) return;
    FittedPose seed = assess_pose(problem_, triple, pose);
    if (seed.chi2 > gate2) seed = fit_pose(problem_, triple, pose);
    if (seed.chi2 <= gate2) seeds.push_back(seed);
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    add(poses[i]);
    if (!prior_ || !on_a_line(problem_, triple, poses[i])) continue;
    for (const Rigid3& turned : turns_by_prior(problem_, naming, poses[i])) add(turned);
  }
  return seeds;
}

void Search::consider(const FittedPose& seed, const Naming& naming) {
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  if (prior_) {
    const double chi2 = prior_chi2(problem_, seed);
    if (!turnout_) prior_chi2_of_seeds_.push_back(chi2);
    if (chi2 > 4 * gate2) return;
  }
  const std::vector<ScoredPair> further = further_pairs(problem_, seed, naming);
  std::vector<Pair> pairs = one_to_one(further);
  const int more = static_cast<int>(pairs.size());
  pairs.insert(pairs.end(), naming.begin(), naming.end());
  seeds_.push_back({naming, more, named_pairs(pairs)});
  if (!worth_keeping(naming, pairs)) return;
  PoseHypothesis explanation = explain(problem_, seed, naming, further);
  if (worth_keeping(naming, explanation.pairs) && believable(problem_, explanation))
    keep(std::move(explanation));
}

void Search::keep(PoseHypothesis explanation) {
  for (const PoseHypothesis& known : found_)
    if (same_pairs(known.pairs, explanation.pairs) &&
        squared_sigmas(explanation.estimate.pose, known.estimate) < same_pose_chi2)
      return;
  account_for_unpaired(problem_, explanation);
  if (turnout_ && misses_too_much(explanation)) return;
  if (!turnout_ || (chance_of(explanation) < unlikely && fits(explanation)))
    most_ = std::max(most_, worth(explanation.pairs));
  found_.push_back(std::move(explanation));
  if (found_.size() >= 4 * max_kept) merge_and_rank();
}

void Search::merge_and_rank() {
  std::stable_sort(
      found_.begin(), found_.end(), [&](const PoseHypothesis& a, const PoseHypothesis& b) {
        return worth(a.pairs) != worth(b.pairs) ? worth(a.pairs) > worth(b.pairs) : a.chi2 < b.chi2;
      });
  std::vector<PoseHypothesis> distinct;
  for (const PoseHypothesis& e : found_) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const PoseHypothesis& d) {
      return same_pairs(e.pairs, d.pairs) &&
             squared_sigmas(e.estimate.pose, d.estimate) < same_pose_chi2;
    });
    if (!known && rivals(e) && distinct.size() < max_kept) distinct.push_back(e);
  }
  found_ = std::move(distinct);
}

}  // namespace occ::internal::identify
