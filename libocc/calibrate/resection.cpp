// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/resection.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/calibrate/internal/pixel_fit.hpp"
#include "libocc/core/random.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/candidates.hpp"
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

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Hypothesis {
  Rigid3 pose;
  double distance_px = infinity;  // so near are half of the points, and three more
};

bool better(const Hypothesis& a, const Hypothesis& b) { return a.distance_px < b.distance_px; }

// The points that the camera's domain holds.
class Problem {
 public:
  Problem(const Matrix3Xd& points, const Matrix2Xd& px, const Camera& camera) : camera_(camera) {
    std::vector<Eigen::Index> those;
    std::vector<Vector3d> bearings;
    for (Eigen::Index i = 0; i < px.cols(); ++i)
      if (const auto ray = camera.ray(px.col(i))) {
        those.push_back(i);
        bearings.push_back(ray->direction);
      }
    points_ = points(Eigen::all, those);
    px_ = px(Eigen::all, those);
    bearings_.resize(3, static_cast<Eigen::Index>(bearings.size()));
    for (std::size_t i = 0; i < bearings.size(); ++i)
      bearings_.col(static_cast<Eigen::Index>(i)) = bearings[i];
  }

  Eigen::Index count() const { return points_.cols(); }
  const Matrix3Xd& points() const { return points_; }
  const Matrix2Xd& px() const { return px_; }

  bool on_a_line() const {
    constexpr double min_width = 1e-4;
    const Matrix3Xd off = points_.colwise() - points_.rowwise().mean();
    const Vector3d spread =
        Matrix3d(off * off.transpose()).selfadjointView<Eigen::Lower>().eigenvalues();
    return !(spread[1] > min_width * min_width * spread[2]);
  }

  // Least median, with the breakdown point of three unknown points (Rousseeuw 1984, section 2).
  double distance_px(const Rigid3& pose) const {
    const Matrix2Xd off = pose_residuals(points_, px_, camera_, pose);
    std::vector<double> distances(static_cast<std::size_t>(off.cols()));
    for (std::size_t i = 0; i < distances.size(); ++i)
      distances[i] = off.col(static_cast<Eigen::Index>(i)).norm();
    const auto n = static_cast<double>(distances.size());
    return quantile(distances, (std::floor(n / 2) + 1) / (n - 1));
  }

  void add_triple(const std::array<Eigen::Index, 3>& triple, std::vector<Hypothesis>& all) const {
    // Bearings of a camera that is not calibrated contradict one another.
    constexpr double tolerance_rad = 0.1;
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

  std::vector<Hypothesis> from_triples(const ResectionOptions& options) const {
    std::vector<Hypothesis> all;
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

bool alike(const Rigid3& a, const Rigid3& b) {
  constexpr double same_rad = 0.02;
  return so3_log(a.rotation * b.rotation.transpose()).norm() < same_rad;
}

// Improves the best few hypotheses that differ, best first.
std::vector<Hypothesis> improved(const Problem& problem, const Camera& camera,
                                 std::vector<Hypothesis> all, const ResectionOptions& options) {
  constexpr std::size_t tried = 12, kept = 4;
  constexpr int rounds = 3;
  std::sort(all.begin(), all.end(), better);
  std::vector<Hypothesis> starts, found;
  for (const Hypothesis& one : all) {
    if (starts.size() == tried) break;
    if (std::none_of(starts.begin(), starts.end(),
                     [&](const Hypothesis& h) { return alike(h.pose, one.pose); }))
      starts.push_back(one);
  }
  for (Hypothesis one : starts) {
    for (int i = 0; i < rounds; ++i) {
      const double sigma =
          std::max(options.min_sigma_px, sigma_of_median_distance * one.distance_px);
      const PixelFit fit =
          fit_pose(problem.points(), problem.px(), camera, one.pose, options.gate * sigma);
      const double distance = problem.distance_px(fit.pose);
      if (!(distance < one.distance_px)) break;
      one = {fit.pose, distance};
    }
    found.push_back(one);
  }
  std::sort(found.begin(), found.end(), better);
  std::vector<Hypothesis> distinct;
  for (const Hypothesis& one : found)
    if (distinct.size() < kept &&
        std::none_of(distinct.begin(), distinct.end(),
                     [&](const Hypothesis& h) { return alike(h.pose, one.pose); }))
      distinct.push_back(one);
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
  const Problem problem(points_m, points_px, camera);
  Resection resection;
  resection.agree.assign(static_cast<std::size_t>(points_m.cols()), false);
  if (problem.count() < 4)
    return failure(Status::too_few_lamps,
                   std::to_string(problem.count()) + " points in the camera's domain; it takes 4",
                   resection);
  if (problem.on_a_line())
    return failure(Status::degenerate, "the points lie on a line", resection);
  const std::vector<Hypothesis> found =
      improved(problem, camera, problem.from_triples(options), options);
  if (found.empty()) return failure(Status::no_pose, "no pose sees half of the points", resection);
  resection.cam_from_world = found.front().pose;
  resection.sigma_px = sigma_of_median_distance * found.front().distance_px;
  const double sigma = std::max(resection.sigma_px, options.min_sigma_px);
  constexpr double nearly_as_good = 3;
  for (std::size_t k = 1; k < found.size(); ++k)
    if (sigma_of_median_distance * found[k].distance_px < nearly_as_good * sigma)
      resection.others.push_back(found[k].pose);
  const Matrix2Xd off = pose_residuals(points_m, points_px, camera, resection.cam_from_world);
  for (Eigen::Index i = 0; i < off.cols(); ++i)
    resection.agree[i] = off.col(i).norm() < options.gate * sigma;
  Result<Resection> result;
  result.value = std::move(resection);
  // Where half of the points are a tenth of the picture off, nothing has been explained.
  constexpr double max_part = 0.1;
  if (result->sigma_px > max_part * std::min(camera.width(), camera.height())) {
    result.status = Status::no_pose;
    result.message = "no pose brings half of the points near to where they were seen";
  }
  return result;
}

std::vector<TagSighting> tag_sightings(const AprilTag& tag, double size_m, const Camera& camera) {
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
  CandidateOptions any;
  any.polish = false;
  any.tolerance_rad = 4;  // the fit judges
  std::vector<TagSighting> poses;
  for (const PoseCandidate& start : pose_candidates(problem, "ippe", any).value) {
    const PixelFit fit = fit_pose(corners, px, camera, start.cam_from_world, infinity);
    if (!std::isfinite(fit.cost)) continue;
    const bool known = std::any_of(poses.begin(), poses.end(), [&](const TagSighting& pose) {
      return alike(pose.cam_from_tag, fit.pose);
    });
    if (!known) poses.push_back({fit.pose, std::sqrt(2 * fit.cost / 4)});
  }
  std::sort(poses.begin(), poses.end(),
            [](const TagSighting& a, const TagSighting& b) { return a.rms_px < b.rms_px; });
  return poses;
}

}  // namespace occ
