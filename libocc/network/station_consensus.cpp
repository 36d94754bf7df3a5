// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/random.hpp"
#include "libocc/network/internal/consensus.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3d;

/// One station with its observations, at a trial pose.
class StationTrial {
 public:
  StationTrial(const Network& network, const NetworkLayout& layout, NetworkState& state,
               int station, const std::vector<int>& observations, double limit)
      : network_(network),
        layout_(layout),
        state_(state),
        station_(station),
        observations_(observations),
        limit_(limit) {}

  const Rigid3& pose() const { return state_.stations[station_]; }
  void place(const Rigid3& pose) { state_.stations[station_] = pose; }

  std::vector<char> inliers() const { return inliers_at(network_, state_, observations_, limit_); }

  /// Gauss-Newton steps on the inliers while their number does not decrease.
  void refine(std::vector<char>& is_inlier) {
    for (int step = 0; step < 6; ++step) {
      Matrix6 information = Matrix6::Zero();
      Vector6 gradient = Vector6::Zero();
      for (std::size_t k = 0; k < observations_.size(); ++k) {
        const ImageObservation& observation = network_.observations[observations_[k]];
        ObservationRows rows;
        if (!is_inlier[k] || !rows_of(network_, layout_, state_, observation, rows)) continue;
        const int column = layout_.images[observation.image].station_column;
        for (int axis = 0; axis < 2; ++axis) {
          const Eigen::Map<const Vector6> a(rows.a[axis] + column);
          information += a * a.transpose();
          gradient -= rows.r[axis] * a;
        }
      }
      const core::Cholesky<Matrix6> cholesky(information);
      if (!cholesky.exists() || !(cholesky.rcond() > 1e-13)) return;
      const Rigid3 before = pose();
      place(perturb(before, cholesky.solve(gradient)));
      std::vector<char> now = inliers();
      if (std::count(now.begin(), now.end(), 1) < std::count(is_inlier.begin(), is_inlier.end(), 1))
        return place(before);
      is_inlier = std::move(now);
    }
  }

  /// Poses from three observations of one image. Rays that do not start at the origin of the camera
  /// are moved there; refine() corrects this.
  std::vector<Rigid3> hypotheses(const std::array<int, 3>& triple) const {
    constexpr double tolerance_rad = 1e-2;
    const NetworkImage& image = network_.images[network_.observations[triple[0]].image];
    Matrix3d bearings, points;
    for (int k = 0; k < 3; ++k) {
      const ImageObservation& observation = network_.observations[triple[k]];
      const auto ray = state_.cameras[image.camera].ray(observation.pixel);
      if (!ray) return {};
      bearings.col(k) = ray->direction;
      points.col(k) = target_position(network_, state_, observation.target);
    }
    std::array<Rigid3, 4> cams_from_world;
    const int found = p3p_within(bearings, points, tolerance_rad, cams_from_world);
    std::vector<Rigid3> poses;
    for (int k = 0; k < found; ++k)
      poses.push_back(image.mount < 0 ? cams_from_world[k]
                                      : state_.mounts[image.mount].inverse() * cams_from_world[k]);
    return poses;
  }

 private:
  const Network& network_;
  const NetworkLayout& layout_;
  NetworkState& state_;
  int station_;
  const std::vector<int>& observations_;
  double limit_;
};

}  // namespace

std::vector<std::vector<int>> observations_of_stations(const Network& network,
                                                       const NetworkLayout& layout) {
  std::vector<std::vector<int>> observations_of_station(network.stations.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const ImageObservation& observation = network.observations[i];
    const int station = network.images[observation.image].station;
    if (observation.used && layout.stations[station] != none &&
        layout.is_determined(observation.target))
      observations_of_station[station].push_back(static_cast<int>(i));
  }
  return observations_of_station;
}

Rigid3 station_consensus(const Network& network, const NetworkLayout& layout, NetworkState& state,
                         int station, const std::vector<int>& observations, double limit) {
  // With half of the observations wrong, 80 triples contain a right one with 99.998 %.
  constexpr int max_triples = 80;
  StationTrial trial(network, layout, state, station, observations, limit);
  const Rigid3 start = trial.pose();
  Rigid3 best_pose = start;
  const auto count = [](const std::vector<char>& is_inlier) {
    return std::count(is_inlier.begin(), is_inlier.end(), 1);
  };
  std::ptrdiff_t best = count(trial.inliers());
  const std::ptrdiff_t total = static_cast<std::ptrdiff_t>(observations.size());
  if (total < 4 || 4 * best >= 3 * total) return start;
  std::vector<std::vector<int>> of_images(network.images.size());
  for (const int i : observations) of_images[network.observations[i].image].push_back(i);
  Random random(0, static_cast<std::uint64_t>(station));
  for (int k = 0; k < max_triples; ++k) {
    const ImageObservation& first =
        network.observations[observations[random.below(static_cast<int>(total))]];
    const std::vector<int>& candidates = of_images[first.image];
    const int n = static_cast<int>(candidates.size());
    if (n < 3) continue;
    const int a = random.below(n), b = (a + 1 + random.below(n - 1)) % n;
    int c = random.below(n - 2);
    for (const int taken : {std::min(a, b), std::max(a, b)}) c += c >= taken;
    for (const Rigid3& pose : trial.hypotheses({candidates[a], candidates[b], candidates[c]})) {
      trial.place(pose);
      std::vector<char> is_inlier = trial.inliers();
      if (count(is_inlier) >= 4) trial.refine(is_inlier);
      // The three observations of the hypothesis agree in any case.
      if (count(is_inlier) > std::max<std::ptrdiff_t>(best, 3)) {
        best = count(is_inlier);
        best_pose = trial.pose();
      }
    }
    trial.place(start);
  }
  trial.place(start);
  return best_pose;
}

}  // namespace occ::internal::network
