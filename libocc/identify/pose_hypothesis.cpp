// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/pose_hypothesis.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libocc/core/internal/dense.hpp"
#include "libocc/identify/internal/size_consistency.hpp"

namespace occ::internal::identify {
namespace {

// Covariance of a point in the camera frame, with the derivative delta_rot x point + delta_trans.
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

// Evaluates the trace of point_covariance for many points:
// |p|^2 tr(RR) - p' RR p + tr(TT) + 2 p . twist.
struct PointSpread {
  explicit PointSpread(const Matrix6& c)
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

// Compares with an upper bound of the gate. It is cheap, and most pairs are far outside the gate.
bool far_outside(const BearingObservation& observation, const MapPoint& map_point,
                 const Eigen::Vector3d& point_in_cam, double spread_trace, double gate2) {
  const Eigen::Vector3d point = point_in_cam - observation.origin;
  const double depth = observation.bearing.dot(point), distance2 = point.squaredNorm();
  const double depth2 = depth * depth;
  if (!(depth > 0) || depth2 < 0.25 * distance2) return true;  // more than 60 degrees apart
  const double shift = map_point.radius_m * map_point.radius_m / observation.axis.dot(point);
  return distance2 - depth2 > gate2 * (distance2 / depth2 * spread_trace +
                                       observation.covariance.trace() * depth2 + shift * shift);
}

std::optional<PairFit> fit_at(const BearingObservation& observation, const MapPoint& map_point,
                              const FittedPose& estimate, const Eigen::Vector3d& point) {
  Mismatch m;
  if (!compare(observation, map_point, estimate.pose.rotation, point, m)) return std::nullopt;
  const Eigen::Matrix2d total = m.covariance + m.by_point *
                                                   point_covariance(estimate.covariance, point) *
                                                   m.by_point.transpose();
  return PairFit{squared_sigmas(m.error, total), total.determinant()};
}

// Returns all pairs within the gate for which wanted(observation, map_point) is true.
template <typename Wanted>
std::vector<ScoredPair> pairs_within_gate(const AssignmentProblem& problem,
                                          const FittedPose& estimate, const Wanted& wanted) {
  const double gate2 = problem.options->gate_sigma * problem.options->gate_sigma;
  const Eigen::Vector3d camera = estimate.pose.origin_in_source();
  const PointSpread bound(estimate.covariance);
  std::vector<ScoredPair> pairs;
  for (int t = 0; t < static_cast<int>(problem.map_points.size()); ++t) {
    const MapPoint& map_point = problem.map_point(t);
    const Eigen::Vector3d point = estimate.pose * map_point.centre;
    if (!(problem.camera->depth_m(point) > 0) || !faces(map_point, camera)) continue;
    const double spread_trace = bound.trace(point);
    for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
      const BearingObservation& observation = problem.observation(s);
      if (!problem.allows(s, t) || !wanted(s, t) ||
          far_outside(observation, map_point, point, spread_trace, gate2) ||
          !sizes_agree(observation, map_point, point))
        continue;
      const auto fit = fit_at(observation, map_point, estimate, point);
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
  const MapPoint& map_point = problem.map_point(pair.map_point);
  Mismatch m;
  return compare(problem.observation(pair.observation), map_point, pose.rotation,
                 pose * map_point.centre, m)
             ? squared_sigmas(m.error, m.covariance)
             : std::numeric_limits<double>::infinity();
}

double worst_chi2(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                  const Rigid3& pose) {
  double worst = 0;
  for (const Pair& pair : pairs) worst = std::max(worst, pair_chi2(problem, pair, pose));
  return worst;
}

// Removes pairs until all residuals are inside the gate. The largest residual may belong to a
// correct pair, because an outlier pulls the pose towards itself. So each pair with a comparable
// chi-square is left out in turn, and the removal that gives the best fit is kept.
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

// Refits the pose with the most likely additional pair. Four pairs usually determine the pose well,
// so that the gates of the remaining pairs shrink.
FittedPose add_best_pair(const AssignmentProblem& problem, const FittedPose& seed,
                         const Assignment& assignment, const std::vector<ScoredPair>& further) {
  if (further.empty()) return seed;
  const auto best =
      std::min_element(further.begin(), further.end(),
                       [](const ScoredPair& a, const ScoredPair& b) { return a.score < b.score; });
  std::vector<Pair> four(assignment.begin(), assignment.end());
  four.push_back(best->pair);
  return fit_pose_with_prior(problem, four, seed.pose);
}

}  // namespace

std::vector<Pair> pairs_of(const AssignmentProblem& problem, const Hypothesis& hypothesis) {
  std::vector<Pair> pairs;
  for (const Match& match : hypothesis.matches)
    for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s)
      if (problem.observation(s).blob == match.blob) pairs.push_back({s, match.lamp});
  return pairs;
}

bool contains(const std::vector<Pair>& pairs, const Pair& pair) {
  return std::any_of(pairs.begin(), pairs.end(), [&](const Pair& p) {
    return p.observation == pair.observation && p.map_point == pair.map_point;
  });
}

bool same_pairs(const std::vector<Pair>& a, const std::vector<Pair>& b) {
  return a.size() == b.size() &&
         std::all_of(a.begin(), a.end(), [&](const Pair& p) { return contains(b, p); });
}

double squared_sigmas(const Rigid3& pose, const FittedPose& estimate) {
  const Vector6 delta = difference(pose, estimate.pose);
  return delta.dot(core::solve_llt(estimate.covariance, delta));
}

bool faces(const MapPoint& map_point, const Eigen::Vector3d& camera_position) {
  const Eigen::Vector3d to_camera = camera_position - map_point.centre;
  const double along = map_point.normal.dot(to_camera);
  const bool inside =
      map_point.cone_cos == 0 ? along > 0 : along > map_point.cone_cos * to_camera.norm();
  return inside && to_camera.squaredNorm() > 4 * map_point.radius_m * map_point.radius_m;
}

bool sizes_agree(const BearingObservation& observation, const MapPoint& map_point,
                 const Eigen::Vector3d& point) {
  const DistanceRange permitted = distances_m(observation, map_point);
  const double distance_m = point.norm();
  return distance_m >= permitted.low && distance_m <= permitted.high;
}

std::optional<PairFit> fit_of_pair(const AssignmentProblem& problem, const Pair& pair,
                                   const FittedPose& estimate) {
  const MapPoint& map_point = problem.map_point(pair.map_point);
  return fit_at(problem.observation(pair.observation), map_point, estimate,
                estimate.pose * map_point.centre);
}

std::vector<ScoredPair> additional_pairs(const AssignmentProblem& problem,
                                         const FittedPose& estimate, const Assignment& assignment) {
  return pairs_within_gate(problem, estimate, [&](int observation, int map_point) {
    return std::none_of(assignment.begin(), assignment.end(), [&](const Pair& p) {
      return p.observation == observation || p.map_point == map_point;
    });
  });
}

std::vector<Pair> one_to_one(std::vector<ScoredPair> candidates) {
  std::sort(candidates.begin(), candidates.end(),
            [](const ScoredPair& a, const ScoredPair& b) { return a.score < b.score; });
  std::vector<Pair> pairs;
  for (const ScoredPair& c : candidates) {
    const bool used = std::any_of(pairs.begin(), pairs.end(), [&](const Pair& p) {
      return p.observation == c.pair.observation || p.map_point == c.pair.map_point;
    });
    if (!used) pairs.push_back(c.pair);
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return a.observation < b.observation; });
  return pairs;
}

double prior_chi2(const AssignmentProblem& problem, const FittedPose& estimate) {
  if (!problem.options->prior) return 0;
  // Minimum over the true pose of the prior's chi-square plus that of the estimate: the chi-square
  // for the sum of both covariances.
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

PoseHypothesis verify_hypothesis(const AssignmentProblem& problem, const FittedPose& seed,
                                 const Assignment& assignment,
                                 const std::vector<ScoredPair>& further) {
  constexpr int max_rounds = 5;
  PoseHypothesis e;
  e.estimate = add_best_pair(problem, seed, assignment, further);
  std::vector<Pair> found(assignment.begin(), assignment.end());
  if (!further.empty()) found = match_all(problem, e.estimate);
  for (int i = 0; i < max_rounds && found.size() >= 3 && !same_pairs(found, e.pairs); ++i) {
    e.pairs = found;
    e.estimate = fit_pose_with_prior(problem, e.pairs, e.estimate.pose);
    found = match_all(problem, e.estimate);
  }
  drop_outliers(problem, e);
  std::sort(e.pairs.begin(), e.pairs.end(),
            [](const Pair& a, const Pair& b) { return a.observation < b.observation; });
  e.chi2 = e.estimate.chi2;
  return e;
}

}  // namespace occ::internal::identify
