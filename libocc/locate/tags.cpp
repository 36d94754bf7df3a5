// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/tags.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/internal/plane_starts.hpp"

namespace occ {

using namespace internal::locate;
namespace {

// Correspondences of world points and pixels.
struct Seen {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> sigmas_px;

  void add(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel,
           const Eigen::Matrix2d& covariance_px2) {
    points.push_back(point);
    pixels.push_back(pixel);
    sigmas_px.push_back(std::sqrt(0.5 * covariance_px2.trace()));
  }

  void add(const AprilTag& tag, double size_m, const Rigid3& world_from_tag) {
    const Eigen::Matrix<double, 3, 4> corners = tag_corners(size_m);
    for (std::size_t k = 0; k < 4; ++k)
      add(world_from_tag * Eigen::Vector3d(corners.col(static_cast<Eigen::Index>(k))),
          tag.corners_px[k], tag.covariance_px2[k]);
  }

  Eigen::Matrix3Xd world() const {
    Eigen::Matrix3Xd columns(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
      columns.col(static_cast<Eigen::Index>(i)) = points[i];
    return columns;
  }

  Eigen::Matrix2Xd image() const {
    Eigen::Matrix2Xd columns(2, static_cast<Eigen::Index>(pixels.size()));
    for (std::size_t i = 0; i < pixels.size(); ++i)
      columns.col(static_cast<Eigen::Index>(i)) = pixels[i];
    return columns;
  }
};

bool same(const Candidate& a, const Candidate& b) {
  constexpr double same_rad = 1e-5;
  return (a.cam_from_world.rotation - b.cam_from_world.rotation).norm() < same_rad;
}

}  // namespace

std::vector<Candidate> tag_poses(const AprilTag& tag, double size_m, const Camera& camera) {
  require(size_m > 0 && std::isfinite(size_m), "size_m", size_m, "positive");
  Seen seen;
  seen.add(tag, size_m, {});
  PoseProblem problem;
  problem.points = seen.world();
  problem.bearings.resize(3, 4);
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d pixel = tag.corners_px[k];
    const auto bearing = camera.unproject(pixel);
    if (!bearing)
      require(false, "corners_px[" + std::to_string(k) + "]", pixel.transpose(),
              "inside the camera's domain");
    problem.bearings.col(k) = *bearing;
  }
  std::vector<Candidate> poses;
  for (const Rigid3& start : internal::pose::plane_starts(problem)) {
    SolvePoseOptions options;
    options.start = start;
    options.sigmas_px = seen.sigmas_px;
    const Result<Fix> fix = solve_pose(problem.points, seen.image(), camera, options);
    if (fix->candidates.empty()) continue;
    const Candidate& found = fix->candidates.front();
    const bool known = std::any_of(poses.begin(), poses.end(),
                                   [&](const Candidate& pose) { return same(pose, found); });
    if (!known) poses.push_back(found);
  }
  std::sort(poses.begin(), poses.end(),
            [](const Candidate& a, const Candidate& b) { return a.chi2 < b.chi2; });
  return poses;
}

Result<Fix> locate_by_tags(const std::vector<AprilTag>& tags, const Scene& scene,
                           const std::map<int, Blob>& lamps) {
  Seen seen;
  for (const Tag& known : scene.tags) {
    const auto is_it = [&](const AprilTag& tag) {
      return tag.id == known.id && tag.family == known.family;
    };
    // Two detections of one id are ambiguous.
    if (std::count_if(tags.begin(), tags.end(), is_it) == 1)
      seen.add(*std::find_if(tags.begin(), tags.end(), is_it), known.size_m,
               known.world_from_tag());
  }
  const bool any_tag = !seen.points.empty();
  for (const auto& [id, blob] : lamps) {
    const auto lamp = std::find_if(scene.lamps.begin(), scene.lamps.end(),
                                   [id = id](const Lamp& l) { return l.id == id; });
    require(lamp != scene.lamps.end(), "lamps: id", id, "of a lamp of the scene");
    seen.add(lamp->centre_m, blob.centroid_px, blob.covariance_px2);
  }
  if (!any_tag && seen.points.size() < 3) {
    Result<Fix> none;
    none.status = Status::too_few_lamps;
    none.message = "none of the " + std::to_string(tags.size()) + " tags seen is one of the " +
                   std::to_string(scene.tags.size()) + " of the scene";
    return none;
  }
  SolvePoseOptions options;
  options.sigmas_px = seen.sigmas_px;
  Result<Fix> fix = solve_pose(seen.world(), seen.image(), scene.camera, options);
  fix.value.lamps = lamps;
  for (Candidate& candidate : fix.value.candidates) candidate.lamps = lamps;
  return fix;
}

}  // namespace occ
