// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/network_checks.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace occ::internal::network {

namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

template <typename Thing>
std::string name_or(const Thing& thing, const char* kind, std::size_t index) {
  return std::string(kind) + " " + (thing.name.empty() ? std::to_string(index) : thing.name);
}

/// Sets of things that observations join (Galler and Fischer's forest).
class Joined {
 public:
  explicit Joined(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t root(std::size_t k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }
  void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::size_t> parent_;
};

std::string list(const std::vector<std::string>& names) {
  constexpr std::size_t most = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(most, names.size()); ++k) text += (k ? ", " : "") + names[k];
  if (names.size() > most) text += " and " + std::to_string(names.size() - most) + " more";
  return text;
}

Objection separate_blocks(const Network& network, const NetworkLayout& layout) {
  const std::size_t stations = network.stations.size();
  const std::size_t points = network.points.size();
  const std::size_t world = stations + points + network.bodies.size();
  Joined joined(world + 1);
  const auto node = [&](const Target& target) {
    return target.body < 0 ? stations + at(target.point) : stations + points + at(target.body);
  };
  std::vector<char> used(stations);
  for (const ImageObservation& seen : network.observations) {
    if (!seen.used || !layout.knows(seen.target)) continue;
    const std::size_t station = at(network.images[seen.image].station);
    used[station] = 1;
    joined.join(station, node(seen.target));
  }
  for (const DistanceObservation& known : network.distances)
    if (known.used) joined.join(node(known.from), node(known.to));
  for (const ControlPoint& known : network.control) joined.join(node(known.target), world);
  for (const PosePrior& prior : network.pose_priors) joined.join(at(prior.station), world);
  for (std::size_t i = 0; i < stations; ++i)
    if (network.stations[i].fixed) joined.join(i, world);
  for (std::size_t i = 0; i < points; ++i)
    if (network.points[i].fixed) joined.join(stations + i, world);
  for (std::size_t i = 0; i < network.bodies.size(); ++i)
    if (network.bodies[i].fixed) joined.join(stations + points + i, world);

  std::map<std::size_t, std::vector<std::string>> blocks;
  for (std::size_t i = 0; i < stations; ++i)
    if (used[i]) blocks[joined.root(i)].push_back(name_or(network.stations[i], "station", i));
  if (blocks.size() < 2) return {};
  const auto smallest = std::min_element(
      blocks.begin(), blocks.end(),
      [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  return {Status::degenerate,
          "the network falls into " + std::to_string(blocks.size()) +
              " blocks that share no target; one of them: " + list(smallest->second)};
}

}  // namespace

Objection objection_to(const Network& network, const NetworkLayout& layout) {
  std::vector<int> of_station(network.stations.size());
  int all = 0;
  for (const ImageObservation& seen : network.observations)
    if (seen.used && layout.knows(seen.target)) {
      ++of_station[network.images[seen.image].station];
      ++all;
    }
  if (all == 0)
    return {Status::too_few_lamps, network.observations.empty()
                                       ? "no target was observed"
                                       : "no target was observed in two images"};
  for (std::size_t i = 0; i < of_station.size(); ++i)
    if (layout.stations[i] != none && of_station[i] > 0 && of_station[i] < 3)
      return {Status::too_few_lamps, name_or(network.stations[i], "station", i) + " shows only " +
                                         std::to_string(of_station[i]) +
                                         " targets that others show too; three are needed"};
  return separate_blocks(network, layout);
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
      if (within(k, block.offset, static_cast<Index>(block.columns.size())))
        name = network.cameras[i].free_parameters[k - block.offset] + " of " +
               name_or(network.cameras[i], "camera", i);
    }
    for (std::size_t i = 0; i < network.mounts.size(); ++i)
      if (within(k, layout.mounts[i], 6)) name = name_or(network.mounts[i], "mount", i);
    for (std::size_t i = 0; i < network.stations.size(); ++i)
      if (within(k, layout.stations[i], 6)) name = name_or(network.stations[i], "station", i);
    for (std::size_t i = 0; i < network.points.size(); ++i)
      if (within(k, layout.points[i], 3)) name = name_or(network.points[i], "point", i);
    for (std::size_t i = 0; i < network.bodies.size(); ++i)
      if (within(k, layout.bodies[i], layout.body_sizes[i]))
        name = name_or(network.bodies[i], "body", i);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return list(names);
}

int count_observations(const Network& network, const NetworkLayout& layout) {
  int rows = 0;
  for (const ImageObservation& seen : network.observations)
    if (seen.used && layout.knows(seen.target)) rows += 2;
  for (const DistanceObservation& known : network.distances)
    if (known.used && layout.knows(known.from) && layout.knows(known.to)) ++rows;
  for (const ControlPoint& known : network.control)
    if (layout.knows(known.target)) rows += 3;
  return rows + static_cast<int>(network.parameter_priors.size() + 6 * network.pose_priors.size());
}

}  // namespace occ::internal::network
