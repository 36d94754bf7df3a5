// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "libocc/network/internal/adjuster.hpp"
#include "libocc/network/internal/consensus.hpp"
#include "libocc/network/internal/known_consensus.hpp"

namespace occ::internal::network {

bool Adjuster::reject_by_images() {
  if (!has_redundant_lengths(network())) return false;
  const Network given = network(), reference = reference_;
  const NetworkLayout layout = layout_;
  network() = without_known(given);
  update_layout();
  if (layout_.determined_point == layout.determined_point &&
      layout_.determined_body == layout.determined_body && check_data() && reject_robustly() &&
      use_known(given))
    return true;
  if (is_stopped_) {
    network().distances = given.distances;
    network().control = given.control;
    update_layout();
    return false;
  }
  result_ = {};
  network() = given;
  reference_ = reference;
  reasons_.clear();
  contradiction_.clear();
  update_layout();
  return false;
}

bool Adjuster::use_known(const Network& given) {
  const KnownConsensus known = known_consensus(network(), given, options_.threads);
  if (!known.reliable) return false;
  network() = transformed(network(), known.to_known);
  network().distances = given.distances;
  network().control = given.control;
  contradiction_ = known.contradiction;
  for (const OutlierCandidate& one : known.distances) reject_distance(one);
  for (const OutlierCandidate& one : known.control) reject_control(one);
  update_layout();
  return check_data();
}

bool Adjuster::reject_robustly() {
  constexpr int rounds = 8, steps = 20;  // limits; usually two rounds of Huber's loss suffice
  double scale = scale_of(residual_lengths());
  for (int round = 0; round < rounds; ++round) {
    if (stopped(stage("robust", {Loss::Kind::huber, scale}, steps, 1e-3))) return false;
    const double next = scale_of(residual_lengths());
    const bool settled = next > 0.9 * scale;
    scale = next;
    if (settled && round > 0) break;
  }
  for (int round = 0; round < 2; ++round) {
    apply_station_consensus(Loss::tukey * scale);
    apply_point_consensus(Loss::tukey * scale, false);
    if (stopped(stage("robust", {Loss::Kind::tukey, scale}, steps, 1e-4))) return false;
    scale = scale_of(residual_lengths());
  }
  apply_point_consensus(Loss::tukey * scale, true);
  const std::vector<double> lengths = residual_lengths();
  for (std::size_t i = 0; i < lengths.size(); ++i)
    if (lengths[i] > Loss::tukey * scale) reject_for(static_cast<int>(i), lengths[i], "robust");
  update_layout();
  leave_out_undetermined_stations();  // least squares would converge slowly, if at all
  return check_data();
}

void Adjuster::apply_station_consensus(double limit) {
  NetworkState state(network());
  const std::vector<std::vector<int>> observations = observations_of_stations(network(), layout_);
  for (std::size_t s = 0; s < observations.size(); ++s)
    if (!observations[s].empty())
      network().stations[s].station_from_world = state.stations[s] =
          station_consensus(network(), layout_, state, static_cast<int>(s), observations[s], limit);
}

void Adjuster::reject_for(int observation, double length, const char* reason) {
  reject(observation, length, std::isfinite(length) ? reason : "not in view");
}

void Adjuster::apply_body_consensus(double limit, bool last, const std::vector<double>& lengths) {
  NetworkState state(network());
  const std::vector<std::vector<int>> observations = observations_of_bodies(network(), layout_);
  for (std::size_t b = 0; b < observations.size(); ++b) {
    if (observations[b].empty()) continue;
    const int body = static_cast<int>(b);
    const BodyConsensus consensus =
        body_consensus(network(), layout_, state, body, observations[b], limit);
    if (!last || consensus.reliable) {
      network().bodies[b].world_from_body = consensus.world_from_body;
      network().bodies[b].scale = consensus.scale;
    }
    if (!last) continue;
    for (const int i : consensus.reliable ? consensus.outliers : observations[b])
      reject_for(i, lengths[i], consensus.reliable ? "robust" : "no agreement");
    if (!consensus.reliable)
      reasons_[{LeftOut::Kind::body, body}] = "is seen differently in each of its images";
  }
}

void Adjuster::apply_point_consensus(double limit, bool last) {
  const NetworkState state(network());
  const std::vector<double> lengths = last ? residual_lengths() : std::vector<double>();
  const std::vector<std::vector<int>> observations = observations_of_points(network(), layout_);
  for (std::size_t p = 0; p < observations.size(); ++p) {
    const int point = static_cast<int>(p);
    const PointConsensus consensus =
        point_consensus(network(), state, point, observations[p], limit);
    if (!last || consensus.reliable) network().points[p].position_m = consensus.position_m;
    if (!last) continue;
    for (const int i : consensus.reliable ? consensus.outliers : observations[p])
      reject_for(i, lengths[i], consensus.reliable ? "robust" : "no agreement");
    if (!consensus.reliable)
      reasons_[{LeftOut::Kind::point, point}] = "is seen differently in each of its images";
  }
  apply_body_consensus(limit, last, lengths);
}

}  // namespace occ::internal::network
