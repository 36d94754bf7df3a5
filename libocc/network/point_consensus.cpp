// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/random.hpp"
#include "libocc/network/internal/consensus.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

constexpr int max_pairs = 40;  // bounds the time for a point with many observations

Rigid3 cam_from_world(const Network& network, const NetworkState& state, int image) {
  const NetworkImage& of_image = network.images[image];
  const Rigid3& station = state.stations[of_image.station];
  return of_image.mount < 0 ? station : state.mounts[of_image.mount] * station;
}

/// All pairs of n indices, or max_pairs random ones.
std::vector<std::pair<int, int>> pairs_of(int n, int seed) {
  std::vector<std::pair<int, int>> pairs;
  if (n * (n - 1) / 2 <= max_pairs) {
    for (int a = 0; a < n; ++a)
      for (int b = a + 1; b < n; ++b) pairs.emplace_back(a, b);
    return pairs;
  }
  Random random(0, static_cast<std::uint64_t>(seed));
  while (pairs.size() < max_pairs) {
    const int a = random.below(n);
    pairs.emplace_back(a, (a + 1 + random.below(n - 1)) % n);
  }
  return pairs;
}

/// One point with its observations, at trial positions.
class PointTrial {
 public:
  PointTrial(const Network& network, const NetworkState& state,
             const std::vector<int>& observations, double limit)
      : network_(network), state_(state), observations_(observations), limit_(limit) {}

  /// For each observation: 1 if its residual at a position is below the limit.
  std::vector<char> inliers(const Vector3d& position) const {
    std::vector<char> is_inlier;
    for (const int i : observations_)
      is_inlier.push_back(residual_length(network_.observations[i], position) < limit_);
    return is_inlier;
  }

  /// Gauss-Newton steps on the inliers, which are determined anew after each step.
  Vector3d refined(Vector3d position, std::vector<char>& is_inlier) const {
    for (int step = 0; step < 6; ++step) {
      Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
      Vector3d gradient = Vector3d::Zero();
      for (std::size_t k = 0; k < observations_.size(); ++k) {
        if (!is_inlier[k]) continue;
        const ImageObservation& observation = network_.observations[observations_[k]];
        add(observation, position, information, gradient);
      }
      const core::Cholesky<Eigen::Matrix3d> cholesky(information);
      if (!cholesky.exists() || !(cholesky.rcond() > 1e-12)) return position;
      const Vector3d next = position + cholesky.solve(gradient);
      std::vector<char> now = inliers(next);
      if (std::count(now.begin(), now.end(), 1) < std::count(is_inlier.begin(), is_inlier.end(), 1))
        return position;
      position = next;
      is_inlier = std::move(now);
    }
    return position;
  }

 private:
  struct Viewpoint {
    Rigid3 cam_from_world;
    const Camera& camera;
  };
  Viewpoint viewpoint(const ImageObservation& observation) const {
    return {cam_from_world(network_, state_, observation.image),
            state_.cameras[network_.images[observation.image].camera]};
  }

  double residual_length(const ImageObservation& observation, const Vector3d& position) const {
    const Viewpoint view = viewpoint(observation);
    const auto pixel = view.camera.project(view.cam_from_world * position);
    if (!pixel || !pixel->allFinite()) return std::numeric_limits<double>::infinity();
    return view.camera.difference_px(*pixel, observation.pixel)
        .cwiseQuotient(observation.sigma_px)
        .norm();
  }

  void add(const ImageObservation& observation, const Vector3d& position,
           Eigen::Matrix3d& information, Vector3d& gradient) const {
    const Viewpoint view = viewpoint(observation);
    Eigen::Matrix<double, 2, 3> d_point;
    const auto pixel = view.camera.project(view.cam_from_world * position, &d_point);
    if (!pixel || !pixel->allFinite()) return;
    const Eigen::Matrix<double, 2, 3> j =
        observation.sigma_px.cwiseInverse().asDiagonal() * d_point * view.cam_from_world.rotation;
    information += j.transpose() * j;
    gradient -=
        j.transpose() *
        view.camera.difference_px(*pixel, observation.pixel).cwiseQuotient(observation.sigma_px);
  }

  const Network& network_;
  const NetworkState& state_;
  const std::vector<int>& observations_;
  double limit_;
};

}  // namespace

std::optional<Eigen::Vector3d> intersect_rays(const std::vector<Ray>& rays) {
  if (rays.size() < 2) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) middle += ray.origin / static_cast<double>(rays.size());
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    normal += across;
    rhs += across * (ray.origin - middle);
  }
  const auto eigen = core::symmetric_eigen<Eigen::Matrix3d>(normal);
  if (!(eigen.eigenvalues()[0] > 1e-10 * eigen.eigenvalues()[2])) return std::nullopt;
  return middle + eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                      eigen.eigenvectors().transpose() * rhs;
}

std::vector<std::vector<int>> observations_of_points(const Network& network,
                                                     const NetworkLayout& layout) {
  std::vector<std::vector<int>> observations_of_point(network.points.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const ImageObservation& observation = network.observations[i];
    if (observation.used && observation.target.body < 0 &&
        layout.points[observation.target.point] != none)
      observations_of_point[observation.target.point].push_back(static_cast<int>(i));
  }
  return observations_of_point;
}

std::optional<Vector3d> intersect_observations(const Network& network, const NetworkState& state,
                                               const std::vector<int>& observations) {
  std::vector<Ray> rays;
  for (const int i : observations) {
    const ImageObservation& observation = network.observations[i];
    const auto ray = state.cameras[network.images[observation.image].camera].ray(observation.pixel);
    if (!ray) continue;
    const Rigid3 world_from_cam = cam_from_world(network, state, observation.image).inverse();
    rays.push_back({world_from_cam * ray->origin, world_from_cam.rotation * ray->direction});
  }
  return intersect_rays(rays);
}

PointConsensus point_consensus(const Network& network, const NetworkState& state, int point,
                               const std::vector<int>& observations, double limit) {
  const PointTrial trial(network, state, observations, limit);
  const auto count = [](const std::vector<char>& is_inlier) {
    return std::count(is_inlier.begin(), is_inlier.end(), 1);
  };
  const std::ptrdiff_t total = static_cast<std::ptrdiff_t>(observations.size());
  PointConsensus result;
  result.position_m = state.points[point];
  std::vector<char> best = trial.inliers(result.position_m);
  bool unique = true;
  const auto is_majority = [&] {
    return count(best) == total || (count(best) >= 3 && 2 * count(best) > total);
  };
  if (!is_majority()) {
    for (const auto& [a, b] : pairs_of(static_cast<int>(total), point)) {
      const auto start = intersect_observations(network, state, {observations[a], observations[b]});
      if (!start) continue;
      std::vector<char> is_inlier = trial.inliers(*start);
      if (count(is_inlier) < 2) continue;
      const Vector3d position = trial.refined(*start, is_inlier);
      if (count(is_inlier) > count(best)) {
        best = is_inlier;
        result.position_m = position;
        unique = true;
      } else if (count(is_inlier) == count(best) && is_inlier != best) {
        unique = false;
      }
    }
  }
  for (std::size_t k = 0; k < best.size(); ++k)
    if (!best[k]) result.outliers.push_back(observations[k]);
  result.reliable = is_majority() || (count(best) >= 2 && unique);
  return result;
}

}  // namespace occ::internal::network
