// SPDX-License-Identifier: Apache-2.0
// Poses from the corners of single rectangles. Four coplanar points have up to two poses. A
// rectangle is the same after half a turn, a square after a quarter, so a square has up to eight.
#include "libocc/identify/internal/search_by_corners.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/internal/blob_corners.hpp"
#include "libocc/core/math.hpp"
#include "libocc/pose/internal/point_fit.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/scene/internal/rectangle_corners.hpp"

namespace occ::internal::identify {
namespace {

constexpr std::size_t corners = 4;
using Points = Eigen::Matrix<double, 3, 4>;

/// Observed directions of the corners with the square root of their information.
struct SeenCorners {
  Points bearings;
  std::array<Eigen::Matrix<double, 2, 3>, corners> across;
};

std::optional<SeenCorners> seen_corners(const AssignmentProblem& problem, const Blob& blob) {
  const double growth_px = blob.saturated ? core::over_exposed_growth_px : 0;
  SeenCorners seen;
  for (std::size_t i = 0; i < corners; ++i) {
    Eigen::Matrix<double, 3, 2> by_pixel;
    const auto bearing = problem.camera->unproject(blob.corners_px[i], &by_pixel);
    if (!bearing) return std::nullopt;
    const Eigen::Vector3d unit = bearing->normalized();
    Eigen::Matrix<double, 2, 3> tangent;
    tangent.row(0) = unit.unitOrthogonal().transpose();
    tangent.row(1) = unit.cross(tangent.row(0).transpose()).transpose();
    const Eigen::Matrix2d covariance_px2 =
        core::corner_covariance_px2(blob, i, problem.options->model_sigma_px, growth_px);
    const Eigen::Matrix2d root =
        tangent * by_pixel * covariance_px2.llt().matrixL().toDenseMatrix() / bearing->norm();
    seen.bearings.col(static_cast<Eigen::Index>(i)) = unit;
    seen.across[i] = root.inverse() * tangent;
  }
  return seen;
}

/// Poses, relative to the lamp's centre, at which the corners fit within the gate.
std::vector<pose::PointFit> poses_of(const SeenCorners& seen, const Points& points, double gate2) {
  constexpr double tolerance_rad = 0.1;  // as for three lamps, see search.cpp
  constexpr int max_iterations = 20;
  constexpr double settled = 1e-6, same = 1e-3;
  const double size_m = points.col(0).norm();  // points in units of their size
  pose::SeenPoints all;
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    all.add(points.col(i) / size_m, seen.bearings.col(i), seen.across[static_cast<std::size_t>(i)]);
  std::vector<pose::PointFit> found;
  for (Eigen::Index left_out = 0; left_out < points.cols(); ++left_out) {
    Eigen::Matrix3d bearings, three;
    for (Eigen::Index i = 0, k = 0; i < points.cols(); ++i) {
      if (i == left_out) continue;
      bearings.col(k) = seen.bearings.col(i);
      three.col(k++) = points.col(i) / size_m;
    }
    std::array<Rigid3, 4> starts;
    const int count = p3p_within(bearings, three, tolerance_rad, starts);
    for (int i = 0; i < count; ++i) {
      const auto fit =
          pose::fit_points(all, starts[static_cast<std::size_t>(i)], max_iterations, settled);
      if (!(fit.equations.chi2 <= gate2)) continue;
      const bool known = std::any_of(found.begin(), found.end(), [&](const pose::PointFit& other) {
        return (other.pose.matrix() - fit.pose.matrix()).norm() < same;
      });
      if (!known) found.push_back(fit);
    }
  }
  for (pose::PointFit& fit : found) fit.pose.translation *= size_m;
  return found;
}

}  // namespace

std::vector<LampPose> corner_poses(const AssignmentProblem& problem, const Blob& blob,
                                   const Lamp& lamp) {
  // Chi-square of two redundant measurements, exceeded once in 10 000.
  constexpr double max_chi2 = 18.4;
  std::vector<LampPose> found;
  const std::optional<SeenCorners> seen = seen_corners(problem, blob);
  if (!seen) return found;
  const Points points = scene::rectangle_corners(lamp);
  const double size_m = points.col(0).norm();
  for (Eigen::Index turn = 0; turn < points.cols(); ++turn) {
    Points turned;
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      turned.col(i) = points.col((i + turn) % points.cols());
    for (const pose::PointFit& fit : poses_of(*seen, turned, max_chi2)) {
      // The equations are for a translation in units of the lamp's size.
      Vector6 unit;
      unit << 1, 1, 1, 1 / size_m, 1 / size_m, 1 / size_m;
      found.push_back({fit.pose, unit.asDiagonal() * fit.equations.information * unit.asDiagonal(),
                       fit.equations.chi2});
    }
  }
  return found;
}

std::optional<LampPose> joint_corner_pose(const AssignmentProblem& problem,
                                          const std::vector<Pair>& pairs, const Rigid3& start) {
  constexpr int max_iterations = 30;
  constexpr double settled = 1e-3;
  const Eigen::Vector3d origin = problem.map_point(pairs.front().map_point).centre;
  const Rigid3 pose{start.rotation, start * origin};
  pose::SeenPoints all;
  for (const Pair& pair : pairs) {
    const BearingObservation& observation = problem.observation(pair.observation);
    const Lamp& lamp = problem.scene->lamps[static_cast<std::size_t>(pair.map_point)];
    if (lamp.shape != LampShape::rectangle || !observation.of_centre) continue;
    const auto seen =
        seen_corners(problem, (*problem.blobs)[static_cast<std::size_t>(observation.blob)]);
    if (!seen) continue;
    const Points points = scene::rectangle_corners(lamp).colwise() +
                          (problem.map_point(pair.map_point).centre - origin);
    // The first corner of the blob may be any of the lamp.
    Eigen::Index turn = 0;
    double best = -infinity;
    for (Eigen::Index t = 0; t < points.cols(); ++t) {
      double cosines = 0;
      for (Eigen::Index i = 0; i < points.cols(); ++i)
        cosines += seen->bearings.col(i).dot((pose * points.col((i + t) % 4)).normalized());
      if (cosines > best) best = cosines, turn = t;
    }
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      all.add(points.col((i + turn) % 4), seen->bearings.col(i),
              seen->across[static_cast<std::size_t>(i)]);
  }
  if (all.count() <= static_cast<int>(corners)) return std::nullopt;
  const pose::PointFit fit = pose::fit_points(all, pose, max_iterations, settled);
  return LampPose{fit.pose, fit.equations.information, fit.equations.chi2};
}

}  // namespace occ::internal::identify
