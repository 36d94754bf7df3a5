// SPDX-License-Identifier: Apache-2.0
// Which unknown of a network stands where. "Reduced" unknowns come first: free parameters of the
// cameras, mounts, stations, and the points and bodies that a distance joins to others. All other
// points and bodies are "eliminated": given the reduced ones, no two of them share an observation.
// Eliminated ones whose images are much the same form batches, so that their part of the reduced
// system is one product of dense matrices.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "libocc/network/network.hpp"

namespace occ::internal::network {

using Eigen::Index;

/// The values of all that may be unknown.
struct NetworkState {
  std::vector<Camera> cameras;
  std::vector<Rigid3> stations, mounts, bodies;
  std::vector<Eigen::Vector3d> points;
  std::vector<double> scales;  ///< of bodies

  explicit NetworkState(const Network& network);
  void put_into(Network& network) const;
};

/// Cameras, stations, mounts, images, points and bodies alone.
Network without_observations(const Network& network);

constexpr Index none = -1;
constexpr int max_columns = Camera::max_parameters + 12;  ///< of an image's unknowns
constexpr int max_group = 7;                              ///< unknowns of a body

struct CameraBlock {
  Index offset = none;
  std::vector<int> columns;  ///< its free parameters, as indices of Camera::parameters()
};

/// An image's unknowns: at most its camera's, its mount's and its station's.
struct ImageBlock {
  int segments = 0, width = 0;
  std::array<Index, 3> offset{};  ///< in the reduced unknowns
  std::array<int, 3> size{};
  int mount_column = -1, station_column = -1;  ///< -1: not unknown
};

/// An eliminated point or body and where it was seen.
struct Group {
  Target block;      ///< corner is 0
  Index offset = 0;  ///< among all unknowns
  int size = 3;
  std::vector<int> observations;
};

struct Batch {
  std::size_t first = 0, last = 0;  ///< groups
  Index columns = 0;
  std::vector<Index> rows;      ///< reduced unknowns that occur; empty: all of them
  std::vector<Index> position;  ///< of each reduced unknown among `rows`
};

struct NetworkLayout {
  std::vector<CameraBlock> cameras;
  std::vector<ImageBlock> images;
  std::vector<Index> mounts, stations, points, bodies;  ///< offset among all unknowns, or none
  std::vector<int> body_sizes;                          ///< 6, or 7 with a free scale
  Index reduced = 0, total = 0;
  std::vector<Group> groups;
  std::vector<Batch> batches;
  std::vector<int> loose;  ///< observations of targets that are not eliminated
  std::vector<char> determined_point, determined_body;  ///< fixed, or unknown and seen well enough
  std::vector<std::string> left_out;                    ///< sentences

  bool knows(const Target& target) const;
  Index offset_of(const Target& target) const {
    return target.body < 0 ? points[target.point] : bodies[target.body];
  }
  int size_of(const Target& target) const { return target.body < 0 ? 3 : body_sizes[target.body]; }
};

NetworkLayout layout_of(const Network& network);

/// Where a target is, and how that changes with its own unknowns: those of a body are a turn about
/// its origin, a shift, and the logarithm of its scale.
Eigen::Vector3d target_position(const Network& network, const NetworkState& state,
                                const Target& target);
Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, max_group> target_jacobian(
    const Network& network, const NetworkLayout& layout, const NetworkState& state,
    const Target& target);

/// The state after a step; nothing when a camera refuses its parameters.
std::optional<NetworkState> moved(const NetworkLayout& layout, const NetworkState& state,
                                  const Eigen::VectorXd& step);

}  // namespace occ::internal::network
