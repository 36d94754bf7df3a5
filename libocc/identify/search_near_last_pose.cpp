// SPDX-License-Identifier: Apache-2.0
// Search for poses that agree with the prior's last pose. All other poses are rejected in the end,
// so each blob is combined only with the lamps that it can show from near the last pose.
//
// If few blobs have more than one such lamp, the pose that matches the nearest lamps is the only
// one: a rival needs other lamps for five sixths of the blobs.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/identify/internal/last_pose.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

// Directions of blobs and lamps, for the assignment of one to the other.
struct Cone {
  Eigen::Vector3d direction;
  double reach_rad = 0;
};

// Directions of a lamp from all poses within the limit of the last pose. A rotation by at most r
// and a shift by at most s turn the direction of a point at the distance d by at most
// r + asin(s / d).
Cone cone_of(const MapPoint& map_point, const Rigid3& last, double turn_rad, double shift_m) {
  const Eigen::Vector3d point = last * map_point.centre;
  const double distance_m = point.norm(), moved_m = shift_m + map_point.radius_m;
  if (!(moved_m < distance_m)) return {Eigen::Vector3d::UnitZ(), infinity};
  return {point / distance_m, turn_rad + std::asin(moved_m / distance_m)};
}

// Largest triangle, roughly, among the pairs.
Assignment spread_assignment(const AssignmentProblem& problem, const std::vector<Pair>& pairs) {
  const auto bearing = [&](const Pair& p) { return problem.observation(p.observation).bearing; };
  const auto best = [&](const auto& value) {
    return *std::max_element(pairs.begin(), pairs.end(), [&](const Pair& a, const Pair& b) {
      return value(bearing(a)) < value(bearing(b));
    });
  };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Pair& p : pairs) mean += bearing(p) / static_cast<double>(pairs.size());
  Assignment three;
  three[0] = best([&](const Eigen::Vector3d& f) { return (f - mean).squaredNorm(); });
  const Eigen::Vector3d a = bearing(three[0]);
  three[1] = best([&](const Eigen::Vector3d& f) { return (f - a).squaredNorm(); });
  const Eigen::Vector3d ab = bearing(three[1]) - a;
  three[2] = best([&](const Eigen::Vector3d& f) { return (f - a).cross(ab).squaredNorm(); });
  return three;
}

// Pairs of a blob and a lamp of which neither is in another pair.
std::vector<Pair> unique_pairs(const AssignmentProblem& problem,
                               const std::vector<ScoredPair>& pairs) {
  std::vector<int> of_blob(problem.observations.size(), 0), of_lamp(problem.map_points.size(), 0);
  for (const ScoredPair& p : pairs) ++of_blob[p.pair.observation], ++of_lamp[p.pair.map_point];
  std::vector<Pair> unique;
  for (const ScoredPair& p : pairs)
    if (of_blob[p.pair.observation] == 1 && of_lamp[p.pair.map_point] == 1)
      unique.push_back(p.pair);
  return unique;
}

// Number of blobs that a pose other than `e` can match to a lamp.
int blobs_with_alternatives(const AssignmentProblem& near, const PoseHypothesis& e) {
  int count = 0;
  for (int s = 0; s < static_cast<int>(near.observations.size()); ++s) {
    const std::vector<int>& lamps = near.observation(s).lamps;
    count += std::any_of(lamps.begin(), lamps.end(), [&](int lamp) {
      return !contains(e.pairs, {s, lamp});
    });
  }
  return count;
}

}  // namespace

Rigid3 last_pose_from_local(const AssignmentProblem& problem) {
  const Rigid3& last = problem.options->prior->last_pose->cam_from_world;
  return {last.rotation, last.translation + last.rotation * problem.origin};
}

AssignmentProblem near_last_pose(const AssignmentProblem& problem) {
  const Matrix6& covariance = problem.options->prior->last_pose->covariance;
  const auto limit = [&](const Eigen::Matrix3d& m) {
    return max_prior_sigmas *
           std::sqrt(core::symmetric_eigen<Eigen::Matrix3d>(m).eigenvalues().maxCoeff());
  };
  const double turn_rad = limit(covariance.topLeftCorner<3, 3>());
  const double shift_m = limit(covariance.bottomRightCorner<3, 3>());
  const Rigid3 last = last_pose_from_local(problem);
  AssignmentProblem near = problem;
  const auto points = problem.map_points.size();
  std::vector<Cone> cones;
  for (const MapPoint& t : problem.map_points) cones.push_back(cone_of(t, last, turn_rad, shift_m));
  for (std::size_t i = 0; i < near.observations.size(); ++i) {
    BearingObservation& s = near.observations[i];
    const double error = problem.options->gate_sigma * s.sigma_rad + s.parallax_rad;
    const auto outside = [&](int t) {
      const double reach = cones[t].reach_rad + error;  // at least the chord of that angle
      const bool far = 2 - 2 * s.bearing.dot(cones[t].direction) > reach * reach;
      if (far) near.allowed[i * points + t] = 0;
      return far;
    };
    s.lamps.erase(std::remove_if(s.lamps.begin(), s.lamps.end(), outside), s.lamps.end());
  }
  return near;
}

// Returns false if the last pose does not limit the search, or if there is none.
bool Search::search_near_last_pose() {
  if (!prior_ || !problem_.options->prior->last_pose ||
      problem_.map_points.size() < min_lamps_of_a_search || problem_.observations.size() < 4)
    return false;
  const AssignmentProblem near = near_last_pose(problem_);
  if (extend_last_pose(near)) return true;
  Search inside(near);
  inside.search_by_pairs();
  adopt(std::move(inside));
  return true;
}

// With the last pose, two pairs determine the pose well enough to predict the others.
void Search::search_by_pairs() {
  by_last_pose_ = true;
  TripleOrder order(problem_, 2);
  groups_in_all_ = order.groups();
  while (const auto group = order.next(max_outliers())) {
    for (const int a : problem_.observation(group->observations[0]).lamps)
      for (const int b : problem_.observation(group->observations[1]).lamps) {
        if (a == b || !covisibility_.pair(a, b)) continue;
        cut_short_ = tried_enough();
        if (cut_short_) return;
        ++tried_;
        try_pair({group->observations[0], a}, {group->observations[1], b});
      }
    ++groups_;
  }
}

void Search::try_pair(const Pair& first, const Pair& second) {
  const double gate2 = problem_.options->gate_sigma * problem_.options->gate_sigma;
  for (const PoseHypothesis& e : found_)
    if (contains(e.pairs, first) && contains(e.pairs, second)) return;
  const FittedPose seed =
      fit_pose_with_prior(problem_, {first, second}, last_pose_from_local(problem_));
  if (!(seed.chi2 <= max_prior_chi2 + gate2)) return;
  const std::vector<ScoredPair> further =
      additional_pairs(problem_, seed, {first, second, {-1, -1}});
  const int pairs = 2 + static_cast<int>(one_to_one(further).size());
  if (pairs < std::max(3, best_support_ - fewer_pairs())) return;
  const auto third =
      std::min_element(further.begin(), further.end(),
                       [](const ScoredPair& a, const ScoredPair& b) { return a.score < b.score; });
  const Assignment three{first, second, third->pair};
  const FittedPose fitted = fit_pose_with_prior(problem_, {three.begin(), three.end()}, seed.pose);
  if (appearance_agrees(problem_, three, fitted.pose)) consider(fitted, three);
}

// Matches the lamps predicted by the last pose. Returns true if no other pose near it can match
// nearly as many blobs; the other P3P solutions of the same pairs are tried as well.
bool Search::extend_last_pose(const AssignmentProblem& near) {
  constexpr int shared = 2;  // pairs that two different poses can have in common
  const Pair none{-1, -1};
  const FittedPose seed{last_pose_from_local(problem_),
                        problem_.options->prior->last_pose->covariance, 0};
  const std::vector<ScoredPair> predicted = additional_pairs(near, seed, {none, none, none});
  const std::vector<Pair> unique = unique_pairs(near, predicted);
  if (unique.size() < 4) return false;
  const Assignment assignment = spread_assignment(near, unique);
  PoseHypothesis e = verify_hypothesis(near, seed, assignment, predicted);
  const int pairs = static_cast<int>(e.pairs.size());
  if (pairs < 4 || blobs_with_alternatives(near, e) + shared >= pairs - pairs / 6 ||
      !agrees_with_prior(problem_, e))
    return false;
  const Rigid3 found = e.estimate.pose;
  by_last_pose_ = true;
  tried_ = 1;
  seeds_.push_back({assignment, pairs - 3, coded_pairs(e.pairs)});
  keep(std::move(e));
  for (const FittedPose& other : candidates_from(assignment)) {
    constexpr double same_rotation = 0.05;
    if ((other.pose.rotation - found.rotation).norm() > same_rotation) consider(other, assignment);
  }
  return !found_.empty();
}

void Search::adopt(Search&& other) {
  found_ = std::move(other.found_);
  best_support_ = other.best_support_;
  best_is_complete_ = other.best_is_complete_;
  tried_ = other.tried_;
  seeds_ = std::move(other.seeds_);
  prior_chi2_of_seeds_ = std::move(other.prior_chi2_of_seeds_);
  statistics_ = other.statistics_;
  groups_ = other.groups_;
  groups_in_all_ = other.groups_in_all_;
  verified_ = other.verified_;
  cut_short_ = other.cut_short_;
}

}  // namespace occ::internal::identify
