// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/tags.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/internal/plane_starts.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"

namespace occ {

using namespace internal::locate;
namespace {

// Vector from the projection of a lamp's centre to its predicted centroid; zero if the pose shows
// the lamp's dark side.
Eigen::Vector2d centroid_offset_px(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world,
                                   const Scene& scene) {
  using internal::refine::predicted_centroid_px;
  const auto centre = predicted_centroid_px(lamp, cam_from_world, scene.camera, Rung::points);
  const auto centroid = predicted_centroid_px(lamp, blob, cam_from_world, scene, Rung::centres);
  if (!centre || !centroid) return Eigen::Vector2d::Zero();
  return scene.camera.difference_px(*centroid, *centre);
}

// Correspondences of world points and pixels.
struct Seen {
  struct LampPoint {
    std::size_t point;
    Lamp lamp;
    const Blob* blob;
  };
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> sigmas_px;
  std::vector<LampPoint> lamps;

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

  void add(const Lamp& lamp, const Blob& blob) {
    lamps.push_back({points.size(), lamp, &blob});
    lamps.back().lamp.validate();
    add(lamp.centre_m, blob.centroid_px, blob.covariance_px2);
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

  // Pixels with the centroids moved to the projections of the lamps' centres.
  Eigen::Matrix2Xd image(const Rigid3& cam_from_world, const Scene& scene) const {
    Eigen::Matrix2Xd columns = image();
    for (const LampPoint& l : lamps)
      columns.col(static_cast<Eigen::Index>(l.point)) -=
          centroid_offset_px(l.lamp, *l.blob, cam_from_world, scene);
    return columns;
  }

  double max_motion_sigmas(const Eigen::Matrix2Xd& from, const Eigen::Matrix2Xd& to) const {
    double largest = 0;
    for (const LampPoint& l : lamps) {
      const auto i = static_cast<Eigen::Index>(l.point);
      largest = std::max(largest, (to.col(i) - from.col(i)).norm() / sigmas_px[l.point]);
    }
    return largest;
  }
};

bool same(const Candidate& a, const Candidate& b) {
  constexpr double same_rad = 1e-5;
  return (a.cam_from_world.rotation - b.cam_from_world.rotation).norm() < same_rad;
}

// Fits the pose and the offsets of the centroids alternately. An offset depends on the distance and
// the tilt of its lamp, so each pass reduces the error to a few percent.
Result<Fix> solve(const Seen& seen, const Scene& scene, const std::optional<Rigid3>& start) {
  constexpr int max_passes = 10;
  constexpr double tolerance_sigmas = 1e-3;
  SolvePoseOptions options;
  options.sigmas_px = seen.sigmas_px;
  options.start = start;
  Eigen::Matrix2Xd pixels = start ? seen.image(*start, scene) : seen.image();
  Result<Fix> fix;
  for (int pass = 0; pass < max_passes; ++pass) {
    fix = solve_pose(seen.world(), pixels, scene.camera, options);
    if (fix->candidates.empty()) break;
    const Eigen::Matrix2Xd moved = seen.image(fix->cam_from_world, scene);
    if (seen.max_motion_sigmas(pixels, moved) < tolerance_sigmas) break;
    pixels = moved;
  }
  return fix;
}

// Fits each of several poses with its own offsets, and keeps those that are plausible beside the
// best.
Result<Fix> solve_each(const Seen& seen, const Scene& scene, const std::vector<Candidate>& starts) {
  std::vector<Result<Fix>> fits;
  for (const Candidate& start : starts) {
    fits.push_back(solve(seen, scene, start.cam_from_world));
    if (fits.back()->candidates.empty()) fits.pop_back();
  }
  const auto pose_of = [](const Result<Fix>& fit) -> const Candidate& {
    return fit->candidates.front();
  };
  std::stable_sort(fits.begin(), fits.end(), [&](const Result<Fix>& a, const Result<Fix>& b) {
    return pose_of(a).chi2 < pose_of(b).chi2;
  });
  if (fits.empty()) return {{}, Status::no_pose, "no pose has all points in front of the camera"};
  Result<Fix> best = fits.front();
  std::vector<Candidate>& poses = best.value.candidates;
  const double max_delta_chi2 = -2 * std::log(SolvePoseOptions{}.max_risk);
  const double misfit = std::max(1.0, poses[0].chi2 / std::max(1, poses[0].dof));
  for (const Result<Fix>& fit : fits) {
    const Candidate& pose = pose_of(fit);
    const bool known = std::any_of(poses.begin(), poses.end(),
                                   [&](const Candidate& other) { return same(pose, other); });
    const double worse = (pose.chi2 - poses[0].chi2) / misfit;
    if (!known && worse <= max_delta_chi2) poses.push_back(pose);
  }
  weigh(best.value, misfit);
  if (best.ok() && poses.size() > 1) {
    best.status = Status::ambiguous;
    best.message = rivals_message(*best);
  }
  return best;
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
    // The centroid of a cut blob is that of the visible part of the lamp.
    if (!blob.cut_by_border) seen.add(*lamp, blob);
  }
  if (!any_tag && seen.points.size() < 3) {
    Result<Fix> none;
    none.status = Status::too_few_lamps;
    none.message = "none of the " + std::to_string(tags.size()) + " tags seen is one of the " +
                   std::to_string(scene.tags.size()) + " of the scene";
    return none;
  }
  Result<Fix> fix = solve(seen, scene, std::nullopt);
  if (!seen.lamps.empty() && fix->candidates.size() > 1)
    fix = solve_each(seen, scene, fix->candidates);
  fix.value.lamps = lamps;
  for (Candidate& candidate : fix.value.candidates) candidate.lamps = lamps;
  return fix;
}

}  // namespace occ
