// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/network_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/name_list.hpp"
#include "libocc/network/internal/consensus.hpp"

namespace occ::internal::network {

namespace {

/// Union-find (Galler, Fischer, "An improved equivalence algorithm", CACM 7, 1964).
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }
  void unite(std::size_t a, std::size_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parent_;
};

std::string list(const std::vector<std::string>& names) {
  return internal::core::name_list(names, 5);
}

/// Degenerate when the stations form blocks that no target, distance or known coordinate connects.
CheckOutcome check_connected(const Network& network, const NetworkLayout& layout) {
  const std::size_t stations = network.stations.size();
  const std::size_t points = network.points.size();
  const std::size_t world = stations + points + network.bodies.size();
  DisjointSets sets(world + 1);
  const auto node = [&](const Target& target) {
    return target.body < 0 ? stations + target.point : stations + points + target.body;
  };
  std::vector<char> used(stations);
  for (const ImageObservation& observation : network.observations) {
    if (!observation.used || !layout.is_determined(observation.target)) continue;
    const std::size_t station = network.images[observation.image].station;
    used[station] = 1;
    sets.unite(station, node(observation.target));
  }
  for (const DistanceObservation& distance : network.distances)
    if (distance.used) sets.unite(node(distance.from), node(distance.to));
  for (const ControlPoint& control : network.control)
    if (control.used) sets.unite(node(control.target), world);
  for (const PosePrior& prior : network.pose_priors) sets.unite(prior.station, world);
  for (std::size_t i = 0; i < stations; ++i)
    if (network.stations[i].fixed) sets.unite(i, world);
  for (std::size_t i = 0; i < points; ++i)
    if (network.points[i].fixed) sets.unite(stations + i, world);
  for (std::size_t i = 0; i < network.bodies.size(); ++i)
    if (network.bodies[i].fixed) sets.unite(stations + points + i, world);

  std::map<std::size_t, std::vector<std::string>> blocks;
  for (std::size_t i = 0; i < stations; ++i)
    if (used[i]) blocks[sets.find(i)].push_back(name_or(network.stations[i], "station", i));
  if (blocks.size() < 2) return {};
  const auto smallest = std::min_element(
      blocks.begin(), blocks.end(),
      [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  return {Status::degenerate,
          "the network consists of " + std::to_string(blocks.size()) +
              " blocks that share no target; one of them: " + list(smallest->second)};
}

}  // namespace

namespace {

constexpr int min_targets = 3, min_outlined = 2;  // that determine a pose

std::vector<int> count_targets_of_stations(const Network& network, const NetworkLayout& layout) {
  std::vector<int> counts(network.stations.size());
  for (const ImageObservation& observation : network.observations)
    if (observation.used && layout.is_determined(observation.target))
      ++counts[network.images[observation.image].station];
  return counts;
}

std::vector<char> stations_with_priors(const Network& network) {
  std::vector<char> has_prior(network.stations.size());
  for (const PosePrior& prior : network.pose_priors) has_prior[prior.station] = 1;
  return has_prior;
}

std::vector<char> stations_with_outlines(const Network& network) {
  std::vector<char> has_outlines(network.stations.size());
  for (const OutlineObservation& outline : network.outlines) {
    const ImageObservation& centre = network.observations[outline.observation];
    if (centre.used) has_outlines[network.images[centre.image].station] = 1;
  }
  return has_outlines;
}

/// Second-order part of a station's residuals [sigmas] at one standard deviation of its pose in the
/// direction that they determine least; infinite if they do not determine it. `state` is used as
/// scratch memory and restored.
double pose_nonlinearity(const Network& network, const NetworkLayout& layout, NetworkState& state,
                         int station, const std::vector<int>& observations) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Matrix6 information = Matrix6::Zero();
  for (const int i : observations) {
    ObservationRows rows;
    if (!rows_of(network, layout, state, network.observations[i], rows)) return infinity;
    const int column = layout.images[network.observations[i].image].station_column;
    for (const auto& row : rows.a) {
      const Eigen::Map<const Vector6> a(row + column);
      information += a * a.transpose();
    }
  }
  const Vector6 scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Matrix6 scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const auto eigen = core::symmetric_eigen<Matrix6>(scaled);
  constexpr double singular = 1e-13;
  if (!(eigen.eigenvalues()[0] > singular)) return infinity;
  const Vector6 step =
      scale.cwiseProduct(eigen.eigenvectors().col(0)) / std::sqrt(eigen.eigenvalues()[0]);
  Eigen::VectorXd second_order = Eigen::VectorXd::Zero(2 * static_cast<Index>(observations.size()));
  const Rigid3 pose = state.stations[station];
  bool in_view = true;
  for (const auto& [side, factor] : {std::pair(1., 0.5), std::pair(-1., 0.5), std::pair(0., -1.)}) {
    state.stations[station] = perturb(pose, side * step);
    Index row = 0;
    for (const int i : observations) {
      double r[2] = {0, 0};
      in_view = in_view && residual_of(network, state, network.observations[i], r);
      for (const double value : r) second_order[row++] += factor * value;
    }
  }
  state.stations[station] = pose;
  return in_view ? second_order.norm() : infinity;
}

}  // namespace

std::vector<WeakStation> weak_stations(const Network& network, const NetworkLayout& layout) {
  const std::vector<char> has_prior = stations_with_priors(network);
  const std::vector<char> has_outlines = stations_with_outlines(network);
  const std::vector<int> counts = count_targets_of_stations(network, layout);
  std::vector<WeakStation> weak;
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (layout.stations[i] != none && !has_prior[i] && counts[i] > 0 &&
        counts[i] < (has_outlines[i] ? min_outlined : min_targets))
      weak.push_back({static_cast<int>(i), counts[i]});
  return weak;
}

std::vector<WeakStation> undetermined_stations(const Network& network, const NetworkLayout& layout,
                                               const std::vector<Index>& suspects) {
  // With x sigmas of second order, another pose fits as well about 1 / x standard deviations away.
  constexpr double max_nonlinearity = 0.15;
  const std::vector<char> has_prior = stations_with_priors(network);
  const std::vector<char> has_outlines = stations_with_outlines(network);
  NetworkState state(network);
  const std::vector<std::vector<int>> observations = observations_of_stations(network, layout);
  std::vector<WeakStation> weak;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const int count = static_cast<int>(observations[i].size());
    const Index offset = layout.stations[i];
    if (count < min_targets || has_prior[i] || has_outlines[i]) continue;
    const bool is_suspect = std::any_of(suspects.begin(), suspects.end(),
                                        [&](Index k) { return k >= offset && k < offset + 6; });
    if (count > min_targets && !is_suspect) continue;
    const int station = static_cast<int>(i);
    if (!(pose_nonlinearity(network, layout, state, station, observations[i]) < max_nonlinearity))
      weak.push_back({station, count});
  }
  return weak;
}

std::size_t count_observing_stations(const Network& network, const NetworkLayout& layout) {
  const std::vector<int> counts = count_targets_of_stations(network, layout);
  return static_cast<std::size_t>(
      std::count_if(counts.begin(), counts.end(), [](int count) { return count > 0; }));
}

CheckOutcome check_solvable(const Network& network, const NetworkLayout& layout) {
  if (count_observing_stations(network, layout) == 0)
    return {Status::too_few_lamps, network.observations.empty()
                                       ? "no target was observed"
                                       : "no target was observed in two images"};
  const std::vector<WeakStation> weak = weak_stations(network, layout);
  if (!weak.empty())
    return {Status::too_few_lamps, name_or(network.stations[weak[0].station], "station",
                                           static_cast<std::size_t>(weak[0].station)) +
                                       " observes only " + std::to_string(weak[0].targets) +
                                       " targets that others observe too; three are needed"};
  return check_connected(network, layout);
}

std::string names_of_unknowns(const Network& network, const NetworkLayout& layout,
                              const std::vector<Index>& reduced) {
  std::vector<std::string> names;
  const auto within = [](Index k, Index offset, Index size) {
    return offset != none && k >= offset && k < offset + size;
  };
  for (const Index k : reduced) {
    std::string name;
    for (std::size_t i = 0; i < network.cameras.size(); ++i) {
      const CameraBlock& block = layout.cameras[i];
      if (block.has_growth && within(k, block.offset + block.size() - 1, 1))
        name = "growth of the outlines of " + name_or(network.cameras[i], "camera", i);
      else if (within(k, block.offset, block.size()))
        name = network.cameras[i].free_parameters[k - block.offset] + " of " +
               name_or(network.cameras[i], "camera", i);
    }
    for (std::size_t i = 0; i < network.mounts.size(); ++i)
      if (within(k, layout.mounts[i], 6)) name = name_or(network.mounts[i], "mount", i);
    for (std::size_t i = 0; i < network.stations.size(); ++i)
      if (within(k, layout.stations[i], 6)) name = name_or(network.stations[i], "station", i);
    for (std::size_t i = 0; i < network.points.size(); ++i)
      if (within(k, layout.points[i], layout.point_sizes[i]))
        name = name_or(network.points[i], "point", i);
    for (std::size_t i = 0; i < network.bodies.size(); ++i)
      if (within(k, layout.bodies[i], layout.body_sizes[i]))
        name = name_or(network.bodies[i], "body", i);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return list(names);
}

int count_observations(const Network& network, const NetworkLayout& layout) {
  int rows = 0;
  for (const ImageObservation& observation : network.observations)
    if (observation.used && layout.is_determined(observation.target)) rows += 2;
  for (const DistanceObservation& distance : network.distances)
    if (distance.used && layout.is_determined(distance.from) && layout.is_determined(distance.to))
      ++rows;
  for (const ControlPoint& control : network.control)
    if (control.used && layout.is_determined(control.target)) rows += 3;
  for (std::size_t i = 0; i < layout.outline_of.size(); ++i)
    if (const OutlineObservation* outline = layout.outline(network, static_cast<int>(i)))
      rows += static_cast<int>(outline->rows.rows());
  for (const CameraBlock& camera : layout.cameras) rows += camera.has_growth;
  return rows + static_cast<int>(network.parameter_priors.size() + 6 * network.pose_priors.size());
}

}  // namespace occ::internal::network
