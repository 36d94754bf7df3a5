// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/resection.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/calibrate/internal/pixel_fit.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/plane_starts.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/scene/tag.hpp"

namespace occ {

using namespace internal::calibrate;
namespace {

using Eigen::Matrix2Xd;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct ScoredPose {
  Rigid3 pose;
  double distance_px = infinity;  ///< ResectionProblem::distance_px
};

bool better(const ScoredPose& a, const ScoredPose& b) { return a.distance_px < b.distance_px; }

/// The points inside the camera's domain.
class ResectionProblem {
 public:
  ResectionProblem(const Matrix3Xd& points, const Matrix2Xd& px, const Camera& camera)
      : camera_(camera) {
    std::vector<Eigen::Index> indices;
    std::vector<Vector3d> bearings;
    for (Eigen::Index i = 0; i < px.cols(); ++i)
      if (const auto ray = camera.ray(px.col(i))) {
        indices.push_back(i);
        bearings.push_back(ray->direction);
      }
    points_ = points(Eigen::all, indices);
    px_ = px(Eigen::all, indices);
    bearings_.resize(3, static_cast<Eigen::Index>(bearings.size()));
    for (std::size_t i = 0; i < bearings.size(); ++i)
      bearings_.col(static_cast<Eigen::Index>(i)) = bearings[i];
  }

  Eigen::Index count() const { return points_.cols(); }
  const Matrix3Xd& points() const { return points_; }
  const Matrix2Xd& px() const { return px_; }

  bool on_a_line() const {
    constexpr double min_width = 1e-4;  // of the points' extent
    const Matrix3Xd residuals = points_.colwise() - points_.rowwise().mean();
    const Vector3d spread =
        Matrix3d(residuals * residuals.transpose()).selfadjointView<Eigen::Lower>().eigenvalues();
    return !(spread[1] > min_width * min_width * spread[2]);
  }

  /// Median of the residuals' lengths, of the order that gives three-point hypotheses the highest
  /// breakdown point (Rousseeuw 1984, section 2).
  double distance_px(const Rigid3& pose) const {
    const Matrix2Xd residuals = pose_residuals(points_, px_, camera_, pose);
    std::vector<double> distances(static_cast<std::size_t>(residuals.cols()));
    for (std::size_t i = 0; i < distances.size(); ++i)
      distances[i] = residuals.col(static_cast<Eigen::Index>(i)).norm();
    const auto n = static_cast<double>(distances.size());
    return quantile(distances, (std::floor(n / 2) + 1) / (n - 1));
  }

  void add_triple(const std::array<Eigen::Index, 3>& triple, std::vector<ScoredPose>& all) const {
    constexpr double tolerance_rad = 0.1;  // bearings of an uncalibrated camera are inconsistent
    Matrix3d bearings, points;
    for (int k = 0; k < 3; ++k) {
      bearings.col(k) = bearings_.col(triple[k]);
      points.col(k) = points_.col(triple[k]);
    }
    std::array<Rigid3, 4> poses;
    const int found = p3p_within(bearings, points, tolerance_rad, poses);
    for (int k = 0; k < found; ++k) {
      const Rigid3& pose = poses[k];
      const double distance = distance_px(pose);
      if (std::isfinite(distance)) all.push_back({pose, distance});
    }
  }

  std::vector<ScoredPose> from_triples(const ResectionOptions& options) const {
    std::vector<ScoredPose> all;
    const Eigen::Index n = count();
    if (n * (n - 1) * (n - 2) / 6 <= options.samples) {
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j < i; ++j)
          for (Eigen::Index k = 0; k < j; ++k) add_triple({i, j, k}, all);
      return all;
    }
    Random random(options.seed);
    for (int s = 0; s < options.samples; ++s) {
      std::array<Eigen::Index, 3> triple{};
      do
        for (Eigen::Index& i : triple) i = random.below(static_cast<int>(n));
      while (triple[0] == triple[1] || triple[1] == triple[2] || triple[0] == triple[2]);
      add_triple(triple, all);
    }
    return all;
  }

 private:
  const Camera& camera_;
  Matrix3Xd points_, bearings_;
  Matrix2Xd px_;
};

bool same_rotation(const Rigid3& a, const Rigid3& b) {
  constexpr double tolerance_rad = 0.02;
  return so3_log(a.rotation * b.rotation.transpose()).norm() < tolerance_rad;
}

/// Refines the best few hypotheses that differ; best first.
std::vector<ScoredPose> refine_best(const ResectionProblem& problem, const Camera& camera,
                                    std::vector<ScoredPose> all, const ResectionOptions& options) {
  constexpr std::size_t max_starts = 12, max_results = 4;
  constexpr int rounds = 3;
  std::sort(all.begin(), all.end(), better);
  std::vector<ScoredPose> starts, found;
  for (const ScoredPose& candidate : all) {
    if (starts.size() == max_starts) break;
    if (std::none_of(starts.begin(), starts.end(),
                     [&](const ScoredPose& h) { return same_rotation(h.pose, candidate.pose); }))
      starts.push_back(candidate);
  }
  for (ScoredPose candidate : starts) {
    // The solution of an ill-conditioned triple is not quite a rotation.
    candidate.pose.rotation = nearest_rotation(candidate.pose.rotation);
    candidate.distance_px = problem.distance_px(candidate.pose);
    for (int i = 0; i < rounds; ++i) {
      const double sigma =
          std::max(options.min_sigma_px, sigma_of_median_distance * candidate.distance_px);
      const PixelFit fit =
          fit_pose(problem.points(), problem.px(), camera, candidate.pose, options.gate * sigma);
      const double distance = problem.distance_px(fit.pose);
      if (!(distance < candidate.distance_px)) break;
      candidate = {fit.pose, distance};
    }
    found.push_back(candidate);
  }
  std::sort(found.begin(), found.end(), better);
  std::vector<ScoredPose> distinct;
  for (const ScoredPose& candidate : found)
    if (distinct.size() < max_results &&
        std::none_of(distinct.begin(), distinct.end(),
                     [&](const ScoredPose& h) { return same_rotation(h.pose, candidate.pose); }))
      distinct.push_back(candidate);
  return distinct;
}

template <typename T>
Result<T> failure(Status status, std::string message, T value = {}) {
  Result<T> result;
  result.value = std::move(value);
  result.status = status;
  result.message = std::move(message);
  return result;
}

}  // namespace

void ResectionOptions::validate() const {
  require(min_sigma_px > 0 && std::isfinite(min_sigma_px), "min_sigma_px", min_sigma_px,
          "positive");
  require(gate >= 2 && std::isfinite(gate), "gate", gate, "at least 2");
  require(samples >= 4, "samples", samples, "at least 4");
}

Result<Resection> resect(const Matrix3Xd& points_m, const Matrix2Xd& points_px,
                         const Camera& camera, const ResectionOptions& options) {
  options.validate();
  require(points_px.cols() == points_m.cols(), "points_px", points_px.cols(), "one for each point");
  require_finite(points_m, "points_m");
  require_finite(points_px, "points_px");
  const ResectionProblem problem(points_m, points_px, camera);
  Resection resection;
  resection.inliers.assign(static_cast<std::size_t>(points_m.cols()), false);
  if (problem.count() < 4)
    return failure(
        Status::too_few_lamps,
        std::to_string(problem.count()) + " points in the camera's domain; the minimum is 4",
        resection);
  if (problem.on_a_line())
    return failure(Status::degenerate, "the points are collinear", resection);
  const std::vector<ScoredPose> found =
      refine_best(problem, camera, problem.from_triples(options), options);
  if (found.empty())
    return failure(Status::no_pose, "no pose has half of the points in view", resection);
  resection.cam_from_world = found.front().pose;
  resection.sigma_px = sigma_of_median_distance * found.front().distance_px;
  const double sigma = std::max(resection.sigma_px, options.min_sigma_px);
  constexpr double max_ratio = 3;
  for (std::size_t k = 1; k < found.size(); ++k)
    if (sigma_of_median_distance * found[k].distance_px < max_ratio * sigma)
      resection.alternatives.push_back(found[k].pose);
  const Matrix2Xd residuals = pose_residuals(points_m, points_px, camera, resection.cam_from_world);
  for (Eigen::Index i = 0; i < residuals.cols(); ++i)
    resection.inliers[i] = residuals.col(i).norm() < options.gate * sigma;
  Result<Resection> result;
  result.value = std::move(resection);
  // A median residual above a tenth of the image size is no better than chance.
  constexpr double max_fraction = 0.1;
  if (result->sigma_px > max_fraction * std::min(camera.width(), camera.height())) {
    result.status = Status::no_pose;
    result.message = "no pose projects half of the points near their observed positions";
  }
  return result;
}

std::vector<TagPoseHypothesis> tag_pose_hypotheses(const AprilTag& tag, double size_m,
                                                   const Camera& camera) {
  require(size_m > 0 && std::isfinite(size_m), "size_m", size_m, "positive");
  const Matrix3Xd corners = tag_corners(size_m);
  Matrix2Xd px(2, 4);
  PoseProblem problem;
  problem.points = corners;
  problem.bearings.resize(3, 4);
  for (int k = 0; k < 4; ++k) {
    px.col(k) = tag.corners_px[k];
    const auto ray = camera.ray(px.col(k));
    if (!ray) return {};
    problem.bearings.col(k) = ray->direction;
  }
  std::vector<TagPoseHypothesis> poses;
  for (const Rigid3& start : internal::pose::plane_starts(problem)) {
    const PixelFit fit = fit_pose(corners, px, camera, start, infinity);
    if (!std::isfinite(fit.cost)) continue;
    const bool duplicate = std::any_of(
        poses.begin(), poses.end(),
        [&](const TagPoseHypothesis& pose) { return same_rotation(pose.cam_from_tag, fit.pose); });
    if (!duplicate) poses.push_back({fit.pose, std::sqrt(2 * fit.cost / 4)});
  }
  std::sort(poses.begin(), poses.end(), [](const TagPoseHypothesis& a, const TagPoseHypothesis& b) {
    return a.rms_px < b.rms_px;
  });
  return poses;
}

}  // namespace occ
