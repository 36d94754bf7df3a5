// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/search.hpp"
//
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/identify/visibility.hpp"
#include "libocc/pose/p3p.hpp"

namespace occ::naming {
namespace {

constexpr std::size_t max_kept = 64;  // explanations; with more the answer is "cannot tell" anyway
constexpr double same_pose_chi2 = 9;  // poses nearer than this in their own sigmas are one

double squared_sigmas(const Rigid3& a, const PoseEstimate& b) {
  const Vector6 delta = difference(a, b.pose);
  return delta.dot(b.covariance.llt().solve(delta));
}

// Share of the image that one blob's gate covers, that of a firm pose's own error included.
double gate_share(const Problem& problem) {
  const Camera& camera = problem.scene->camera;
  const double image = camera.width() * camera.height() / (camera.fx_px() * camera.fy_px());
  double ellipses = 0;
  for (const Sighting& s : problem.sightings) ellipses += std::sqrt(s.covariance.determinant());
  const double gate = problem.options->gate_sigma;
  const double pi = std::acos(-1.0);
  return 2 * pi * gate * gate * ellipses / (static_cast<double>(problem.sightings.size()) * image);
}

}  // namespace

Search::Search(const Problem& problem) : problem_(problem) {
  prior_ = problem.options->prior && !problem.options->prior->empty();
}

void Search::run() {
  TripleOrder order(problem_);
  while (const auto triple = order.next(false_lights())) {
    try_triple(*triple);
    if (cut_short_) break;
  }
  merge_and_rank();
}

// How many of the blobs may be false in an explanation worth finding. Beyond six pairs a second one
// can hardly be chance, so few alternatives need ruling out.
int Search::false_lights() const {
  const std::size_t blobs = problem_.sightings.size();
  const int unexplained = static_cast<int>(blobs - std::max<std::size_t>(most_pairs_, 3));
  return most_pairs_ >= 6 ? std::min(unexplained, 2) : unexplained;
}

// Any three blobs fit some pose: three of more say nothing unless named or backed by a prior.
std::size_t Search::least_pairs(const Naming& naming) const {
  const bool named = std::all_of(naming.begin(), naming.end(), [&](const Pair& p) {
    return problem_.sighting(p.sighting).named;
  });
  const std::size_t enough = named || prior_ || problem_.sightings.size() == 3 ? 3 : 4;
  return std::max(enough, most_pairs_);
}

void Search::try_triple(const BlobTriple& triple) {
  Naming naming;
  for (std::size_t i = 0; i < 3; ++i) naming[i].sighting = triple.sightings[i];
  for (const int a : problem_.sighting(triple.sightings[0]).lamps)
    for (const int b : problem_.sighting(triple.sightings[1]).lamps)
      for (const int c : problem_.sighting(triple.sightings[2]).lamps) {
        if (a == b || b == c || c == a) continue;
        if (tried_ == problem_.options->max_hypotheses) {
          cut_short_ = true;
          return;
        }
        ++tried_;
        naming[0].target = a;
        naming[1].target = b;
        naming[2].target = c;
        if (!contradicts_view(naming)) try_naming(naming);
      }
}

// Accidents with four pairs are counted: poses that gather a fourth and do not belong to the best
// explanation (once for each of its triples, so this is an upper bound). Four make the pose firm:
// each further pair then comes with the share of the image that its gate covers.
double Search::chance() const {
  if (found_.empty()) return 0;
  const std::vector<Pair>& best = found_.front().pairs;
  double poses = 0, accidents = 0;
  for (const Seed& seed : seeds_) {
    if (std::all_of(seed.naming.begin(), seed.naming.end(),
                    [&](const Pair& p) { return contains(best, p); }))
      continue;
    poses += 1;
    accidents += seed.extra;
  }
  double expected = best.size() == 3 ? poses : accidents;
  for (std::size_t pairs = 5; pairs <= best.size(); ++pairs) {
    const double lamps = static_cast<double>(problem_.targets.size() - (pairs - 1));
    const double blobs = static_cast<double>(problem_.sightings.size() - (pairs - 1));
    expected *= lamps * blobs * gate_share(problem_) / static_cast<double>(pairs - 3);
  }
  return expected;
}

// Lamps in one plane that face the same side are seen from that side only, so three of them run the
// same way round in the image: half of all namings fall without a pose.
bool Search::contradicts_view(const Naming& naming) const {
  const Target &a = problem_.target(naming[0].target), &b = problem_.target(naming[1].target),
               &c = problem_.target(naming[2].target);
  const Eigen::Vector3d across = (b.centre - a.centre).cross(c.centre - a.centre);
  const double facing = across.dot(a.normal);
  const double flat = (1 - 1e-9) * across.norm();
  if (std::abs(facing) < flat || std::abs(across.dot(b.normal)) < flat ||
      std::abs(across.dot(c.normal)) < flat || a.normal.dot(b.normal) < 0 ||
      a.normal.dot(c.normal) < 0)
    return false;
  const Sighting &i = problem_.sighting(naming[0].sighting),
                 &j = problem_.sighting(naming[1].sighting),
                 &k = problem_.sighting(naming[2].sighting);
  const Eigen::Vector3d ij = j.bearing - i.bearing, ik = k.bearing - i.bearing;
  const double turn = i.bearing.dot(ij.cross(ik));
  const double noise = problem_.options->gate_sigma * (i.sigma_rad + j.sigma_rad + k.sigma_rad) *
                       std::max(ij.norm(), ik.norm());
  return std::abs(turn) > noise && (turn > 0) == (facing > 0);
}

void Search::try_naming(const Naming& naming) {
  Eigen::Matrix3d bearings, points;
  double sigma_rad = 0;
  for (int i = 0; i < 3; ++i) {
    const Pair& pair = naming[static_cast<std::size_t>(i)];
    const Sighting& sighting = problem_.sighting(pair.sighting);
    bearings.col(i) = sighting.bearing;
    points.col(i) = problem_.target(pair.target).centre;
    sigma_rad = std::max(sigma_rad, sighting.sigma_rad);
  }
  std::array<Rigid3, 4> poses;
  const int count =
      p3p_within(bearings, points, 2 * problem_.options->gate_sigma * sigma_rad, poses);
  for (int i = 0; i < count; ++i) consider(poses[static_cast<std::size_t>(i)], naming);
}

void Search::consider(const Rigid3& pose, const Naming& naming) {
  const Eigen::Vector3d camera = pose.origin_in_source();
  for (const Pair& p : naming)
    if (!faces(problem_.target(p.target), camera)) return;
  const std::vector<Pair> triple(naming.begin(), naming.end());
  const PoseEstimate seed{pose, pose_covariance(problem_, triple, pose), 0};
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  if (prior_ && prior_chi2(problem_, seed) > 4 * gate2) return;
  const std::vector<ScoredPair> further = further_pairs(problem_, seed, naming);
  std::vector<Pair> pairs = one_to_one(further);
  seeds_.push_back({naming, static_cast<int>(pairs.size())});
  if (pairs.size() + 3 < least_pairs(naming)) return;
  pairs.insert(pairs.end(), naming.begin(), naming.end());
  for (const Explanation& known : found_)
    if (same_pairs(known.pairs, pairs) &&
        squared_sigmas(known.estimate.pose, seed) < same_pose_chi2)
      return;
  Explanation explanation = explain(problem_, seed, naming, further);
  if (explanation.pairs.size() >= least_pairs(naming)) keep(std::move(explanation));
}

void Search::keep(Explanation explanation) {
  for (const Explanation& known : found_)
    if (same_pairs(known.pairs, explanation.pairs) &&
        squared_sigmas(explanation.estimate.pose, known.estimate) < same_pose_chi2)
      return;
  if (explanation.pairs.size() > most_pairs_) {
    found_.clear();
    most_pairs_ = explanation.pairs.size();
  }
  account_for_unpaired(problem_, explanation);
  found_.push_back(std::move(explanation));
  if (found_.size() >= 4 * max_kept) merge_and_rank();
}

void Search::merge_and_rank() {
  std::stable_sort(found_.begin(), found_.end(),
                   [](const Explanation& a, const Explanation& b) { return a.chi2 < b.chi2; });
  std::vector<Explanation> distinct;
  for (Explanation& e : found_) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Explanation& d) {
      return squared_sigmas(e.estimate.pose, d.estimate) < same_pose_chi2;
    });
    if (!known && distinct.size() < max_kept) distinct.push_back(std::move(e));
  }
  found_ = std::move(distinct);
}

}  // namespace occ::naming
