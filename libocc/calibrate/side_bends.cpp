// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "libocc/calibrate/resection.hpp"
#include "libocc/scene/tag.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Least squares fit of b (1 - u^2) to evenly spaced points of a side.
double bend_of(const Camera& camera, const Vector3d& from, const Vector3d& to) {
  constexpr int intervals = 10;
  const auto first = camera.project(from), last = camera.project(to);
  if (!first || !last) return 0;
  const Vector2d chord = camera.difference_px(*last, *first), along = chord.normalized();
  const Vector2d normal(-along.y(), along.x());
  double sum = 0, squares = 0;
  for (int i = 1; i < intervals; ++i) {
    const auto at = camera.project(from + (to - from) * i / intervals);
    if (!at) return 0;
    const Vector2d off = camera.difference_px(*at, *first) - 0.5 * chord;
    const double u = 2 * off.dot(along) / chord.norm(), shape = 1 - u * u;
    sum += off.dot(normal) * shape;
    squares += shape * shape;
  }
  const double bend = sum / squares;
  return std::isfinite(bend) ? bend : 0;
}

}  // namespace

std::function<std::array<double, 4>(const std::array<Vector2d, 4>& corners_px)> side_bends(
    const Camera& camera) {
  return [camera](const std::array<Vector2d, 4>& corners_px) {
    std::array<double, 4> bends{};
    AprilTag tag;
    tag.corners_px = corners_px;
    const std::vector<TagPoseHypothesis> hypotheses = tag_pose_hypotheses(tag, 1, camera);
    if (hypotheses.empty()) return bends;
    const Eigen::Matrix<double, 3, 4> corners = tag_corners(1);
    for (int k = 0; k < 4; ++k)
      bends[k] = bend_of(camera, hypotheses[0].cam_from_tag * Vector3d(corners.col(k)),
                         hypotheses[0].cam_from_tag * Vector3d(corners.col((k + 1) % 4)));
    return bends;
  };
}

}  // namespace occ
