// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/point_agreement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <utility>

#include "libocc/core/random.hpp"
#include "libocc/network/internal/intersect_rays.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

constexpr int max_pairs = 40;

Rigid3 cam_from_world(const Network& network, const NetworkState& state, int image) {
  const NetworkImage& taken = network.images[image];
  const Rigid3& station = state.stations[taken.station];
  return taken.mount < 0 ? station : state.mounts[taken.mount] * station;
}

/// All pairs of n things, or as many drawn by lot.
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

/// A point alone that may be put anywhere.
class Point {
 public:
  Point(const Network& network, const NetworkState& state, const std::vector<int>& observations,
        double limit)
      : network_(network), state_(state), all_(observations), limit_(limit) {}

  /// Which observations agree with a position.
  std::vector<char> agreeing(const Vector3d& position) const {
    std::vector<char> agree;
    for (const int i : all_)
      agree.push_back(length_at(network_.observations[i], position) < limit_);
    return agree;
  }

  /// Gauss and Newton's steps with those that agree, counted anew between.
  Vector3d refined(Vector3d position, std::vector<char>& agree) const {
    for (int step = 0; step < 6; ++step) {
      Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
      Vector3d gradient = Vector3d::Zero();
      for (std::size_t k = 0; k < all_.size(); ++k) {
        if (!agree[k]) continue;
        const ImageObservation& seen = network_.observations[all_[k]];
        add(seen, position, information, gradient);
      }
      const Eigen::LLT<Eigen::Matrix3d> factor(information);
      if (factor.info() != Eigen::Success || !(factor.rcond() > 1e-12)) return position;
      const Vector3d next = position + factor.solve(gradient);
      std::vector<char> now = agreeing(next);
      if (std::count(now.begin(), now.end(), 1) < std::count(agree.begin(), agree.end(), 1))
        return position;
      position = next;
      agree = std::move(now);
    }
    return position;
  }

 private:
  struct Seen {
    Rigid3 cam_from_world;
    const Camera& camera;
  };
  Seen place(const ImageObservation& seen) const {
    return {cam_from_world(network_, state_, seen.image),
            state_.cameras[network_.images[seen.image].camera]};
  }

  double length_at(const ImageObservation& seen, const Vector3d& position) const {
    const Seen from = place(seen);
    const auto pixel = from.camera.project(from.cam_from_world * position);
    if (!pixel || !pixel->allFinite()) return std::numeric_limits<double>::infinity();
    return from.camera.difference_px(*pixel, seen.pixel).cwiseQuotient(seen.sigma_px).norm();
  }

  void add(const ImageObservation& seen, const Vector3d& position, Eigen::Matrix3d& information,
           Vector3d& gradient) const {
    const Seen from = place(seen);
    Eigen::Matrix<double, 2, 3> d_point;
    const auto pixel = from.camera.project(from.cam_from_world * position, &d_point);
    if (!pixel || !pixel->allFinite()) return;
    const Eigen::Matrix<double, 2, 3> j =
        seen.sigma_px.cwiseInverse().asDiagonal() * d_point * from.cam_from_world.rotation;
    information += j.transpose() * j;
    gradient -=
        j.transpose() * from.camera.difference_px(*pixel, seen.pixel).cwiseQuotient(seen.sigma_px);
  }

  const Network& network_;
  const NetworkState& state_;
  const std::vector<int>& all_;
  double limit_;
};

}  // namespace

std::vector<std::vector<int>> sightings_of_points(const Network& network,
                                                  const NetworkLayout& layout) {
  std::vector<std::vector<int>> seen_by(network.points.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const ImageObservation& seen = network.observations[i];
    if (seen.used && seen.target.body < 0 && layout.points[seen.target.point] != none)
      seen_by[seen.target.point].push_back(static_cast<int>(i));
  }
  return seen_by;
}

std::optional<Vector3d> meeting_of(const Network& network, const NetworkState& state,
                                   const std::vector<int>& observations) {
  std::vector<Ray> rays;
  for (const int i : observations) {
    const ImageObservation& seen = network.observations[i];
    const auto ray = state.cameras[network.images[seen.image].camera].ray(seen.pixel);
    if (!ray) continue;
    const Rigid3 world_from_cam = cam_from_world(network, state, seen.image).inverse();
    rays.push_back({world_from_cam * ray->origin, world_from_cam.rotation * ray->direction});
  }
  return intersect_rays(rays);
}

PointAgreement agreement_about(const Network& network, const NetworkState& state, int point,
                               const std::vector<int>& observations, double limit) {
  const Point alone(network, state, observations, limit);
  const auto count = [](const std::vector<char>& agree) {
    return std::count(agree.begin(), agree.end(), 1);
  };
  const std::ptrdiff_t all = static_cast<std::ptrdiff_t>(observations.size());
  PointAgreement result;
  result.position_m = state.points[point];
  std::vector<char> best = alone.agreeing(result.position_m);
  bool unique = true;
  const auto is_most = [&] {
    return count(best) == all || (count(best) >= 3 && 2 * count(best) > all);
  };
  if (!is_most()) {
    for (const auto& [a, b] : pairs_of(static_cast<int>(all), point)) {
      const auto meeting = meeting_of(network, state, {observations[a], observations[b]});
      if (!meeting) continue;
      std::vector<char> agree = alone.agreeing(*meeting);
      if (count(agree) < 2) continue;
      const Vector3d position = alone.refined(*meeting, agree);
      if (count(agree) > count(best)) {
        best = agree;
        result.position_m = position;
        unique = true;
      } else if (count(agree) == count(best) && agree != best) {
        unique = false;
      }
    }
  }
  for (std::size_t k = 0; k < best.size(); ++k)
    if (!best[k]) result.disagree.push_back(observations[k]);
  result.sound = is_most() || (count(best) >= 2 && unique);
  return result;
}

}  // namespace occ::internal::network
