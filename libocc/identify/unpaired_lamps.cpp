// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/scene/view.hpp"

namespace occ::internal::identify {
namespace {

struct Expected {
  int lamp = 0;
  Eigen::Vector2d px;
  double radius_px = 0;
  bool reliable = false;  // inside the cone of reliable detection
};

bool is_behind_a_box(const AssignmentProblem& problem, const MapPoint& map_point,
                     const Eigen::Vector3d& camera) {
  if (!problem.scene) return false;
  return hidden_by_box(problem.scene->boxes, map_point.centre + problem.origin,
                       camera + problem.origin);
}

// Predicts the image of an unpaired lamp; nothing if it faces away, is behind a box or out of view.
std::optional<Expected> expect(const AssignmentProblem& problem, int lamp, const Rigid3& pose) {
  const MapPoint& map_point = problem.map_point(lamp);
  const Eigen::Vector3d to_camera = pose.origin_in_source() - map_point.centre;
  const double distance = to_camera.norm();
  if (!faces(map_point, pose.origin_in_source()) ||
      is_behind_a_box(problem, map_point, pose.origin_in_source()))
    return std::nullopt;
  const Camera& camera = *problem.camera;
  const auto px = camera.project(pose * map_point.centre);
  if (!px) return std::nullopt;
  const double focal_px = std::max(camera.fx_px(), camera.fy_px());
  return Expected{lamp, *px, focal_px * map_point.radius_m / distance,
                  map_point.normal.dot(to_camera) / distance >= map_point.reliable_cos};
}

// Distance of a point from a blob's bounding box; 0 inside. Measured from the middle of the box,
// because columns across the seam of a panorama differ by its period.
double distance_px(const Blob& blob, const Camera& camera, const Eigen::Vector2d& px) {
  const Eigen::Vector2d low(blob.x0, blob.y0), high(blob.x1, blob.y1);
  const Eigen::Vector2d off = camera.difference_px(px, (low + high) / 2);
  return (off.cwiseAbs() - (high - low) / 2).cwiseMax(0).norm();
}

// A merged blob contains the centres of its lamps. The visible part of a cut lamp is within one
// radius. A blob that is much larger than a few lamps, each grown by saturation, covers the lamp.
bool may_hold(const Blob& blob, const Camera& camera, const Expected& expected, double margin_px) {
  constexpr double lamps = 4, growth = 1.5, growth_px = 5;
  const double grown_px = growth * expected.radius_px + growth_px;
  if (blob.area_px > lamps * pi * grown_px * grown_px) return false;
  const double reach = blob.cut_by_border ? expected.radius_px + margin_px : margin_px;
  return distance_px(blob, camera, expected.px) <= reach;
}

// Returns the partial blob nearest to the predicted image; -1 if there is none.
int find_partial_blob(const AssignmentProblem& problem, const std::vector<Match>& attached,
                      const Expected& expected, double margin_px) {
  const Camera& camera = *problem.camera;
  int nearest = -1;
  double min_distance = std::numeric_limits<double>::infinity();
  for (const int index : problem.partial_blobs) {
    const Blob& blob = (*problem.blobs)[index];
    const bool taken = std::any_of(attached.begin(), attached.end(),
                                   [&](const Match& m) { return m.blob == index; });
    const double distance = camera.difference_px(blob.centroid_px, expected.px).norm();
    if (taken || distance >= min_distance || !may_hold(blob, camera, expected, margin_px)) continue;
    nearest = index;
    min_distance = distance;
  }
  return nearest;
}

// True if the lamp is hidden by the image of another lamp, or merged with it.
bool is_covered(const AssignmentProblem& problem, const Expected& expected, double margin_px) {
  return std::any_of(problem.blobs->begin(), problem.blobs->end(), [&](const Blob& blob) {
    return distance_px(blob, *problem.camera, expected.px) <= margin_px;
  });
}

}  // namespace

void account_for_unpaired_lamps(const AssignmentProblem& problem, PoseHypothesis& hypothesis) {
  const double margin_px = problem.options->gate_sigma * (problem.options->model_sigma_px + 0.5);
  for (int lamp = 0; lamp < static_cast<int>(problem.map_points.size()); ++lamp) {
    const bool paired = std::any_of(hypothesis.pairs.begin(), hypothesis.pairs.end(),
                                    [&](const Pair& p) { return p.map_point == lamp; });
    if (paired || problem.map_point(lamp).duplicate) continue;
    const std::optional<Expected> expected = expect(problem, lamp, hypothesis.estimate.pose);
    if (!expected) continue;
    const int partial = find_partial_blob(problem, hypothesis.attached, *expected, margin_px);
    if (partial >= 0) hypothesis.attached.push_back({lamp, partial});
    const bool well_inside =
        border_distance_px(*problem.camera, expected->px) > expected->radius_px + margin_px;
    if (partial >= 0 || !well_inside || !expected->reliable ||
        is_covered(problem, *expected, margin_px))
      continue;
    ++hypothesis.missed;
    hypothesis.chi2 += problem.options->miss_penalty;
  }
}

}  // namespace occ::internal::identify
