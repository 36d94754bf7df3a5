// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/localisation_value.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/refine/bound.hpp"

namespace occ {
namespace {

std::vector<int> points_in_view(const Object& object, const Camera& camera, const Rigid3& pose) {
  std::vector<int> seen;
  for (int i = 0; i < static_cast<int>(object.points.size()); ++i) {
    const ObjectPoint& point = object.points[i];
    const auto px = camera.project(pose * point.position_m);
    if (px && camera.contains(*px) && point.seen_from(pose.origin_in_source())) seen.push_back(i);
  }
  return seen;
}

// Bound computed from all points except one.
Result<PoseBound> bound_without(const Object& object, const std::vector<int>& seen, int left_out,
                                const Camera& camera, const Rigid3& pose, double sigma_px) {
  std::vector<Eigen::Vector3d> points_m;
  for (const int i : seen)
    if (i != left_out) points_m.push_back(object.points[i].position_m);
  return pose_bound(points_m, camera, pose, sigma_px);
}

}  // namespace

std::vector<Rigid3> views_around(const Object& object, const std::vector<double>& distances_m,
                                 int directions) {
  require(directions > 0, "directions", directions, "positive");
  require(!distances_m.empty(), "distances_m", "none", "at least one");
  Eigen::Vector3d low = object.points.front().position_m, high = low;
  for (const ObjectPoint& point : object.points) {
    low = low.cwiseMin(point.position_m);
    high = high.cwiseMax(point.position_m);
  }
  const Eigen::Vector3d middle = 0.5 * (low + high);
  std::vector<Rigid3> views;
  for (const double distance : distances_m) {
    require(distance > 0 && std::isfinite(distance), "distances_m", distance, "positive");
    for (int i = 0; i < directions; ++i) {  // Fibonacci lattice
      const double z = 1 - (2 * i + 1.0) / directions, across = std::sqrt(1 - z * z);
      const double turn = i * pi * (3 - std::sqrt(5.0));
      const Eigen::Vector3d way(across * std::cos(turn), across * std::sin(turn), z);
      const Eigen::Vector3d up =
          across > 1e-3 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
      views.push_back(look_at(middle + distance * way, middle, up));
    }
  }
  return views;
}

LocalisationValue localisation_value(const Object& object, const Camera& camera,
                                     const std::vector<Rigid3>& cam_from_object, double sigma_px) {
  require(!cam_from_object.empty(), "cam_from_object", "none", "at least one");
  require(sigma_px > 0 && std::isfinite(sigma_px), "sigma_px", sigma_px, "positive");
  LocalisationValue value;
  value.points.resize(object.points.size());
  std::vector<double> log_growth(object.points.size(), 0), position_sigmas_m, rotation_sigmas_rad;
  std::vector<int> compared(object.points.size(), 0);
  const double share = 1 / static_cast<double>(cam_from_object.size());
  for (const Rigid3& pose : cam_from_object) {
    const std::vector<int> seen = points_in_view(object, camera, pose);
    for (const int i : seen) value.points[i].seen += share;
    const auto all = bound_without(object, seen, -1, camera, pose, sigma_px);
    if (!all.ok()) continue;
    value.determined += share;
    position_sigmas_m.push_back(std::sqrt(all->position_covariance_m2.trace()));
    rotation_sigmas_rad.push_back(std::sqrt(all->covariance.topLeftCorner<3, 3>().trace()));
    for (const int i : seen) {
      const auto k = static_cast<std::size_t>(i);
      const auto rest = bound_without(object, seen, i, camera, pose, sigma_px);
      if (!rest.ok()) {
        value.points[k].needed += share;
        continue;
      }
      constexpr double sigmas = 12;  // the determinant is a product of six variances
      log_growth[k] +=
          std::log(rest->covariance.determinant() / all->covariance.determinant()) / sigmas;
      ++compared[k];
    }
  }
  for (std::size_t k = 0; k < compared.size(); ++k)
    if (compared[k] > 0) value.points[k].growth = std::exp(log_growth[k] / compared[k]);
  value.sigma_m = median(position_sigmas_m);
  value.sigma_rad = median(rotation_sigmas_rad);
  return value;
}

}  // namespace occ
