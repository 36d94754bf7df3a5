// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/visibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>

#include "libocc/scene/view.hpp"

namespace occ::internal::identify {
namespace {

struct Expected {
  int lamp = 0;
  Eigen::Vector2d px;
  double radius_px = 0;
  bool sure = false;  // not seen so obliquely that it may be overlooked
};

bool is_behind_a_box(const AssignmentProblem& problem, const MapPoint& target,
                     const Eigen::Vector3d& camera) {
  return problem.scene && hidden_by_box(problem.scene->boxes, target.centre + problem.origin,
                                        camera + problem.origin);
}

// Where an unpaired lamp's image must be; nothing when it shows its dark side, is behind a box or
// out of view.
std::optional<Expected> expect(const AssignmentProblem& problem, int lamp, const Rigid3& pose) {
  const MapPoint& target = problem.target(lamp);
  const Eigen::Vector3d to_camera = pose.origin_in_source() - target.centre;
  const double distance = to_camera.norm();
  if (!faces(target, pose.origin_in_source()) ||
      is_behind_a_box(problem, target, pose.origin_in_source()))
    return std::nullopt;
  const Camera& camera = *problem.camera;
  const auto px = camera.project(pose * target.centre);
  if (!px) return std::nullopt;
  const double focal_px = std::max(camera.fx_px(), camera.fy_px());
  return Expected{lamp, *px, focal_px * target.radius_m / distance,
                  target.normal.dot(to_camera) / distance >= target.sure_cos};
}

// Distance of a point from a blob's bounding box; 0 inside.
double distance_px(const Blob& blob, const Eigen::Vector2d& px) {
  const Eigen::Vector2d low(blob.x0, blob.y0), high(blob.x1, blob.y1);
  return (px - px.cwiseMax(low).cwiseMin(high)).norm();
}

// A merged blob covers its lamps' centres; of a cut one the visible part is within a radius.
bool may_hold(const Blob& blob, const Expected& expected, double margin_px) {
  const double reach = blob.cut_by_border ? expected.radius_px + margin_px : margin_px;
  return distance_px(blob, expected.px) <= reach;
}

// The weak blob nearest to where the lamp must be; -1 when there is none.
int find_weak_blob(const AssignmentProblem& problem, const std::vector<Match>& attached,
                   const Expected& expected, double margin_px) {
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (const int index : problem.weak_blobs) {
    const Blob& blob = (*problem.blobs)[index];
    const bool taken = std::any_of(attached.begin(), attached.end(),
                                   [&](const Match& m) { return m.blob == index; });
    const double distance = (blob.centroid_px - expected.px).norm();
    if (taken || distance >= least || !may_hold(blob, expected, margin_px)) continue;
    nearest = index;
    least = distance;
  }
  return nearest;
}

// Behind the image of another lamp, or in a blob that holds several.
bool is_covered(const AssignmentProblem& problem, const Expected& expected, double margin_px) {
  return std::any_of(problem.blobs->begin(), problem.blobs->end(),
                     [&](const Blob& blob) { return distance_px(blob, expected.px) <= margin_px; });
}

}  // namespace

void account_for_unpaired(const AssignmentProblem& problem, PoseHypothesis& explanation) {
  const double margin_px = problem.options->gate_sigma * (problem.options->model_sigma_px + 0.5);
  for (int lamp = 0; lamp < static_cast<int>(problem.targets.size()); ++lamp) {
    const bool paired = std::any_of(explanation.pairs.begin(), explanation.pairs.end(),
                                    [&](const Pair& p) { return p.target == lamp; });
    if (paired || problem.target(lamp).twin) continue;
    const std::optional<Expected> expected = expect(problem, lamp, explanation.estimate.pose);
    if (!expected) continue;
    const int weak = find_weak_blob(problem, explanation.attached, *expected, margin_px);
    if (weak >= 0) explanation.attached.push_back({lamp, weak});
    const bool well_inside =
        border_distance_px(*problem.camera, expected->px) > expected->radius_px + margin_px;
    if (weak >= 0 || !well_inside || !expected->sure || is_covered(problem, *expected, margin_px))
      continue;
    ++explanation.missed;
    explanation.chi2 += problem.options->miss_penalty;
  }
}

}  // namespace occ::internal::identify
