// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/explain.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace occ::internal::identify {
namespace {

// Covariance of a point in the camera's frame: it moves by delta_rot x point + delta_trans.
Eigen::Matrix3d point_covariance(const Matrix6& pose_covariance, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << 0, point.z(), -point.y(), 1, 0, 0,  //
      -point.z(), 0, point.x(), 0, 1, 0,          //
      point.y(), -point.x(), 0, 0, 0, 1;
  return jacobian * pose_covariance * jacobian.transpose();
}

double squared_sigmas(const Eigen::Vector2d& error, const Eigen::Matrix2d& covariance) {
  return error.dot(covariance.inverse() * error);
}

// Trace of point_covariance for many points, quickly: |p|^2 tr(RR) - p' RR p + tr(TT) + 2 p .
// twist.
struct SpreadBound {
  explicit SpreadBound(const Matrix6& c)
      : rotation(c.topLeftCorner<3, 3>()),
        rotation_trace(rotation.trace()),
        translation_trace(c.bottomRightCorner<3, 3>().trace()),
        twist(c(4, 2) - c(5, 1), c(5, 0) - c(3, 2), c(3, 1) - c(4, 0)) {}
  double trace(const Eigen::Vector3d& p) const {
    return p.squaredNorm() * rotation_trace - p.dot(rotation * p) + translation_trace +
           2 * p.dot(twist);
  }

  Eigen::Matrix3d rotation;
  double rotation_trace, translation_trace;
  Eigen::Vector3d twist;
};

// Upper bound of the gate, and cheap: most pairs are far outside it.
bool far_outside(const BearingObservation& sighting, const MapPoint& target,
                 const Eigen::Vector3d& point_in_cam, double spread_trace, double gate2) {
  const Eigen::Vector3d point = point_in_cam - sighting.origin;
  const double depth = sighting.bearing.dot(point), distance2 = point.squaredNorm();
  const double depth2 = depth * depth;
  if (!(depth > 0) || depth2 < 0.25 * distance2) return true;  // 60 degrees off
  const double shift = target.radius_m * target.radius_m / sighting.axis.dot(point);
  return distance2 - depth2 > gate2 * (distance2 / depth2 * spread_trace +
                                       sighting.covariance.trace() * depth2 + shift * shift);
}

std::optional<PairFit> fit_at(const BearingObservation& sighting, const MapPoint& target,
                              const FittedPose& estimate, const Eigen::Vector3d& point) {
  Mismatch m;
  if (!compare(sighting, target, estimate.pose.rotation, point, m)) return std::nullopt;
  const Eigen::Matrix2d total = m.covariance + m.by_point *
                                                   point_covariance(estimate.covariance, point) *
                                                   m.by_point.transpose();
  return PairFit{squared_sigmas(m.error, total), total.determinant()};
}

// All pairs within the gate that `wanted(sighting, target)`.
template <typename Wanted>
std::vector<ScoredPair> pairs_within_gate(const AssignmentProblem& problem,
                                          const FittedPose& estimate, const Wanted& wanted) {
  const double gate2 = problem.options->gate_sigma * problem.options->gate_sigma;
  const Eigen::Vector3d camera = estimate.pose.origin_in_source();
  const SpreadBound bound(estimate.covariance);
  std::vector<ScoredPair> pairs;
  for (int t = 0; t < static_cast<int>(problem.targets.size()); ++t) {
    const MapPoint& target = problem.target(t);
    const Eigen::Vector3d point = estimate.pose * target.centre;
    if (!(problem.camera->depth_m(point) > 0) || !faces(target, camera)) continue;
    const double spread_trace = bound.trace(point);
    for (int s = 0; s < static_cast<int>(problem.sightings.size()); ++s) {
      const BearingObservation& sighting = problem.sighting(s);
      if (!problem.may_be(s, t) || !wanted(s, t) ||
          far_outside(sighting, target, point, spread_trace, gate2) ||
          !sizes_agree(sighting, target, point))
        continue;
      const auto fit = fit_at(sighting, target, estimate, point);
      if (fit && fit->chi2 <= gate2)
        pairs.push_back({{s, t}, fit->chi2 + std::log(fit->determinant)});
    }
  }
  return pairs;
}

std::vector<Pair> match_all(const AssignmentProblem& problem, const FittedPose& estimate) {
  return one_to_one(pairs_within_gate(problem, estimate, [](int, int) { return true; }));
}

double pair_chi2(const AssignmentProblem& problem, const Pair& pair, const Rigid3& pose) {
  const MapPoint& target = problem.target(pair.target);
  Mismatch m;
  return compare(problem.sighting(pair.sighting), target, pose.rotation, pose * target.centre, m)
             ? squared_sigmas(m.error, m.covariance)
             : std::numeric_limits<double>::infinity();
}

double worst_chi2(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                  const Rigid3& pose) {
  double worst = 0;
  for (const Pair& pair : pairs) worst = std::max(worst, pair_chi2(problem, pair, pose));
  return worst;
}

// Drops pairs until all residuals are inside the gate. A false pair that pulls the pose over makes
// a true one the farthest out, so of those outside it is the one without which the rest fits best.
void drop_outliers(const AssignmentProblem& problem, PoseHypothesis& e) {
  const double gate2 = problem.options->gate_sigma * problem.options->gate_sigma;
  while (e.pairs.size() >= 3) {
    const double worst = worst_chi2(problem, e.pairs, e.estimate.pose);
    if (worst <= gate2) return;
    constexpr double comparable = 0.1;
    std::vector<Pair> best;
    FittedPose estimate = e.estimate;
    for (std::size_t i = 0; i < e.pairs.size(); ++i) {
      if (pair_chi2(problem, e.pairs[i], e.estimate.pose) < comparable * worst) continue;
      std::vector<Pair> rest = e.pairs;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
      if (rest.size() < 3) {
        best = rest;
        break;
      }
      const FittedPose without = fit_pose_with_prior(problem, rest, e.estimate.pose);
      if (!best.empty() && !(without.chi2 < estimate.chi2)) continue;
      best = rest;
      estimate = without;
    }
    e.pairs = best;
    e.estimate = estimate;
  }
}

// A pose from three pairs first gets the one further pair that is surest: with four it is firm, and
// the others are no longer guesses.
FittedPose firm_up(const AssignmentProblem& problem, const FittedPose& seed, const Naming& naming,
                   const std::vector<ScoredPair>& further) {
  if (further.empty()) return seed;
  const auto surest =
      std::min_element(further.begin(), further.end(),
                       [](const ScoredPair& a, const ScoredPair& b) { return a.score < b.score; });
  std::vector<Pair> four(naming.begin(), naming.end());
  four.push_back(surest->pair);
  return fit_pose_with_prior(problem, four, seed.pose);
}

}  // namespace

bool contains(const std::vector<Pair>& pairs, const Pair& pair) {
  return std::any_of(pairs.begin(), pairs.end(), [&](const Pair& p) {
    return p.sighting == pair.sighting && p.target == pair.target;
  });
}

bool same_pairs(const std::vector<Pair>& a, const std::vector<Pair>& b) {
  return a.size() == b.size() &&
         std::all_of(a.begin(), a.end(), [&](const Pair& p) { return contains(b, p); });
}

bool faces(const MapPoint& target, const Eigen::Vector3d& camera_position) {
  const Eigen::Vector3d to_camera = camera_position - target.centre;
  const double along = target.normal.dot(to_camera);
  const bool inside = target.cone_cos == 0 ? along > 0 : along > target.cone_cos * to_camera.norm();
  return inside && to_camera.squaredNorm() > 4 * target.radius_m * target.radius_m;
}

bool sizes_agree(const BearingObservation& sighting, const MapPoint& target,
                 const Eigen::Vector3d& point) {
  if (!target.disc || sighting.largest_radius_rad == 0) return true;
  const double radius_rad = target.radius_m / point.norm();
  return radius_rad > sighting.min_radius_rad && radius_rad < sighting.largest_radius_rad;
}

std::optional<PairFit> fit_of_pair(const AssignmentProblem& problem, const Pair& pair,
                                   const FittedPose& estimate) {
  const MapPoint& target = problem.target(pair.target);
  return fit_at(problem.sighting(pair.sighting), target, estimate, estimate.pose * target.centre);
}

std::vector<ScoredPair> further_pairs(const AssignmentProblem& problem, const FittedPose& estimate,
                                      const Naming& naming) {
  return pairs_within_gate(problem, estimate, [&](int sighting, int target) {
    return std::none_of(naming.begin(), naming.end(), [&](const Pair& p) {
      return p.sighting == sighting || p.target == target;
    });
  });
}

std::vector<Pair> one_to_one(std::vector<ScoredPair> candidates) {
  std::sort(candidates.begin(), candidates.end(),
            [](const ScoredPair& a, const ScoredPair& b) { return a.score < b.score; });
  std::vector<Pair> pairs;
  for (const ScoredPair& c : candidates) {
    const bool taken = std::any_of(pairs.begin(), pairs.end(), [&](const Pair& p) {
      return p.sighting == c.pair.sighting || p.target == c.pair.target;
    });
    if (!taken) pairs.push_back(c.pair);
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return a.sighting < b.sighting; });
  return pairs;
}

double prior_chi2(const AssignmentProblem& problem, const FittedPose& estimate) {
  if (!problem.options->prior) return 0;
  // The least sum of the prior's chi-square and the pose's own is that of the sum of variances.
  Prior prior = *problem.options->prior;
  const double turn2 = estimate.covariance.topLeftCorner<3, 3>().trace();
  const double shift2 = estimate.covariance.bottomRightCorner<3, 3>().trace();
  prior.position_sigmas_m =
      (prior.position_sigmas().array().square() + shift2).sqrt().matrix().eval();
  prior.height_sigma_m = std::hypot(prior.height_sigma_m, std::sqrt(shift2));
  prior.heading_sigma_rad = std::hypot(prior.heading_sigma_rad, std::sqrt(turn2));
  prior.gravity_sigma_rad = std::hypot(prior.gravity_sigma_rad, std::sqrt(turn2));
  if (prior.last_pose) prior.last_pose->covariance += estimate.covariance;
  return prior.chi2(problem.from_world(estimate.pose));
}

PoseHypothesis explain(const AssignmentProblem& problem, const FittedPose& seed,
                       const Naming& naming, const std::vector<ScoredPair>& further) {
  constexpr int max_rounds = 5;
  PoseHypothesis e;
  e.estimate = firm_up(problem, seed, naming, further);
  std::vector<Pair> found(naming.begin(), naming.end());
  if (!further.empty()) found = match_all(problem, e.estimate);
  for (int i = 0; i < max_rounds && found.size() >= 3 && !same_pairs(found, e.pairs); ++i) {
    e.pairs = found;
    e.estimate = fit_pose_with_prior(problem, e.pairs, e.estimate.pose);
    found = match_all(problem, e.estimate);
  }
  drop_outliers(problem, e);
  std::sort(e.pairs.begin(), e.pairs.end(),
            [](const Pair& a, const Pair& b) { return a.sighting < b.sighting; });
  e.chi2 = e.estimate.chi2;
  return e;
}

}  // namespace occ::internal::identify
