// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/search_by_one_lamp.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/internal/circle_of_disc.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/identify/internal/search_by_corners.hpp"
#include "libocc/identify/internal/search_by_outline.hpp"
#include "libocc/identify/internal/turned_discs.hpp"

namespace occ::internal::identify {

namespace {

/// Left perturbation of a pose by a rotation of a lamp about its centre and a translation of it: a
/// rotation about the centre c, in the camera's frame, is one about the camera and the translation
/// c x rotation.
Matrix6 from_lamp(const Eigen::Vector3d& centre_in_cam) {
  Matrix6 move = Matrix6::Identity();
  move.bottomLeftCorner<3, 3>() = skew(centre_in_cam);
  return move;
}

}  // namespace

FittedPose to_local(const LampPose& lamp, const Eigen::Vector3d& centre) {
  FittedPose estimate;
  estimate.pose.rotation = lamp.pose.rotation;
  estimate.pose.translation = lamp.pose.translation - lamp.pose.rotation * centre;
  const Matrix6 move = from_lamp(lamp.pose.translation);
  estimate.covariance = move * core::inverse(lamp.information) * move.transpose();
  estimate.chi2 = lamp.chi2;
  return estimate;
}

namespace {

void add_circles(const AssignmentProblem& problem, const Pair& pair,
                 const std::vector<LampPose>& poses, std::vector<PoseCircle>& circles) {
  const Lamp& disc = problem.scene->lamps[static_cast<std::size_t>(pair.map_point)];
  for (const LampPose& pose : poses) {
    const int blob = problem.observation(pair.observation).blob;
    Rigid3 start = pose.pose;  // from the world's origin
    start.translation -= pose.pose.rotation * disc.centre_m;
    PoseCircle circle = circle_of_disc(
        start, disc, (*problem.blobs)[static_cast<std::size_t>(blob)], *problem.camera);
    circle.lamp = pair.map_point;
    circle.blob = blob;
    if (!(circle.height_m > 0) || !circle.information.allFinite()) continue;
    LampPose exact;
    exact.pose = {circle.cam_from_world.rotation, circle.cam_from_world * disc.centre_m};
    const Matrix6 move = from_lamp(exact.pose.translation);
    exact.information = move.transpose() * circle.information * move;
    if (prior_permits_a_turn(problem, problem.map_point(pair.map_point), exact))
      circles.push_back(circle);
  }
}

/// True if the camera sees the lit sides of the lamps and the prior allows the pose.
bool is_possible(const AssignmentProblem& problem, const PoseHypothesis& e) {
  const Eigen::Vector3d camera = e.estimate.pose.origin_in_source();
  return e.estimate.covariance.allFinite() &&
         std::all_of(
             e.pairs.begin(), e.pairs.end(),
             [&](const Pair& pair) { return faces(problem.map_point(pair.map_point), camera); }) &&
         prior_chi2(problem, e.estimate) <= max_prior_chi2;
}

/// Removes poses that fit the corners six times worse than the best one, and those that are listed
/// twice. Equal chi2 keep their order.
void keep_best(std::vector<PoseHypothesis>& found) {
  constexpr double times_worse = 36, min_limit = 36, same_pose_chi2 = 0.01;
  const auto rounded = [](const PoseHypothesis& e) { return std::round(1e3 * e.chi2); };
  std::stable_sort(
      found.begin(), found.end(),
      [&](const PoseHypothesis& a, const PoseHypothesis& b) { return rounded(a) < rounded(b); });
  std::vector<PoseHypothesis> best;
  for (PoseHypothesis& e : found) {
    if (e.chi2 > std::max(min_limit, times_worse * found.front().chi2)) break;
    const bool is_known = std::any_of(best.begin(), best.end(), [&](const PoseHypothesis& other) {
      return same_pairs(other.pairs, e.pairs) &&
             squared_sigmas(e.estimate.pose, other.estimate) < same_pose_chi2;
    });
    if (!is_known) best.push_back(std::move(e));
  }
  found = std::move(best);
}

}  // namespace

OneLampPoses one_lamp_poses(const AssignmentProblem& problem, bool& cut_short) {
  constexpr std::size_t max_blobs_for_circles = 2;  // one disc among many blobs proves nothing
  OneLampPoses result;
  std::vector<PoseHypothesis>& found = result.hypotheses;
  if (!problem.scene || !problem.camera->is_central()) return result;
  for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
    if (problem.out_of_time()) {
      cut_short = true;
      break;
    }
    const BearingObservation& observation = problem.observation(s);
    const Blob& blob = (*problem.blobs)[static_cast<std::size_t>(observation.blob)];
    if (blob.has_hidden_sides()) continue;
    OutlineSearch by_outline(problem, blob);
    for (const int t : observation.lamps) {
      const Lamp& lamp = problem.scene->lamps[static_cast<std::size_t>(t)];
      const MapPoint& map_point = problem.map_point(t);
      const bool by_corners = lamp.shape == LampShape::rectangle && observation.of_centre;
      std::vector<LampPose> poses =
          by_corners ? corner_poses(problem, blob, lamp) : by_outline.poses(lamp);
      if (lamp.shape == LampShape::disc) {
        if (problem.observations.size() <= max_blobs_for_circles)
          add_circles(problem, {s, t}, poses, result.circles);
        poses = turned_poses(problem, {s, t}, poses);
      }
      for (const LampPose& pose : poses) {
        PoseHypothesis e;
        e.estimate = to_local(pose, map_point.centre);
        const Assignment one{Pair{s, t}, Pair{-1, -1}, Pair{-1, -1}};
        e.pairs = {one[0]};
        if (!is_possible(problem, e)) continue;
        e.pairs = one_to_one(additional_pairs(problem, e.estimate, one));
        e.pairs.push_back(one[0]);
        std::sort(e.pairs.begin(), e.pairs.end(),
                  [](const Pair& a, const Pair& b) { return a.observation < b.observation; });
        if (const auto joint = joint_corner_pose(problem, e.pairs, e.estimate.pose)) {
          e.estimate = to_local(*joint, problem.map_point(e.pairs.front().map_point).centre);
          if (!is_possible(problem, e)) continue;
        }
        e.chi2 = e.estimate.chi2;
        account_for_unpaired_lamps(problem, e);
        found.push_back(std::move(e));
      }
    }
  }
  // Only the poses that match the most blobs: the others leave them unexplained.
  std::size_t most = 0;
  for (const PoseHypothesis& e : found) most = std::max(most, e.pairs.size());
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&](const PoseHypothesis& e) { return e.pairs.size() < most; }),
              found.end());
  keep_best(found);
  if (!found.empty()) result.circles.clear();
  return result;
}

}  // namespace occ::internal::identify
