// SPDX-License-Identifier: Apache-2.0
// Order of a network's unknowns. "Reduced" unknowns come first: free camera parameters, mounts,
// stations, and the points and bodies at the ends of measured distances. All other points and
// bodies are "eliminated" (Schur complement): no observation involves two of them. Eliminated
// points and bodies that are observed in similar sets of images form batches, so that their part of
// the reduced system is one product of dense matrices.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "libocc/network/internal/free_parameter.hpp"
#include "libocc/network/network.hpp"

namespace occ::internal::network {

using Eigen::Index;

/// Values of everything that may be unknown.
struct NetworkState {
  std::vector<Camera> cameras;
  std::vector<Rigid3> stations, mounts, bodies;
  std::vector<Eigen::Vector3d> points;
  std::vector<double> scales;  ///< one per body

  explicit NetworkState(const Network& network);
  void write_to(Network& network) const;
};

/// Copy with cameras, stations, mounts, images, points and bodies only.
Network without_observations(const Network& network);

constexpr Index none = -1;
constexpr int max_columns = Camera::max_parameters + 12;  ///< unknowns of an image
constexpr int max_group = 7;                              ///< unknowns of a body with a free scale

struct CameraBlock {
  Index offset = none;
  std::vector<ParameterColumns> columns;  ///< free parameters
};

/// Unknowns of an image: up to three segments (camera, mount, station).
struct ImageBlock {
  int segments = 0, width = 0;
  std::array<Index, 3> offset{};  ///< first reduced unknown of the segment
  std::array<int, 3> size{};
  int mount_column = -1, station_column = -1;  ///< -1: fixed or absent
};

/// An eliminated point or body with its image observations.
struct Group {
  Target block;      ///< the point, or corner 0 of the body
  Index offset = 0;  ///< first of its unknowns among all unknowns
  int size = 3;
  std::vector<int> observations;
};

struct Batch {
  std::size_t first = 0, last = 0;  ///< groups [first, last)
  Index columns = 0;
  std::vector<Index> rows;      ///< reduced unknowns involved; empty: all of them
  std::vector<Index> position;  ///< index of each reduced unknown in `rows`, or none
};

struct NetworkLayout {
  std::vector<CameraBlock> cameras;
  std::vector<ImageBlock> images;
  std::vector<Index> mounts, stations, points, bodies;  ///< first unknown among all, or none
  std::vector<int> body_sizes;                          ///< 6, or 7 with a free scale
  Index reduced = 0, total = 0;
  std::vector<Group> groups;
  std::vector<Batch> batches;
  std::vector<int> direct;  ///< observations of targets that are not eliminated
  /// Fixed, or unknown with enough observations.
  std::vector<char> determined_point, determined_body;

  bool is_determined(const Target& target) const;
  Index offset_of(const Target& target) const {
    return target.body < 0 ? points[target.point] : bodies[target.body];
  }
  int size_of(const Target& target) const { return target.body < 0 ? 3 : body_sizes[target.body]; }
};

NetworkLayout layout_of(const Network& network);

/// Position of a target [m], and its derivative with respect to the target's own unknowns. Those of
/// a body: rotation vector about its origin, translation, logarithm of the scale.
Eigen::Vector3d target_position(const Network& network, const NetworkState& state,
                                const Target& target);
Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, max_group> target_jacobian(
    const Network& network, const NetworkLayout& layout, const NetworkState& state,
    const Target& target);

/// State after a step; nothing when a camera model rejects the new parameters.
std::optional<NetworkState> apply_step(const NetworkLayout& layout, const NetworkState& state,
                                       const Eigen::VectorXd& step);

}  // namespace occ::internal::network
