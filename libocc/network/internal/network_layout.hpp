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
  /// One per point, if any has an outline; those of points without one have no meaning.
  std::vector<NetworkOutline> outlines;
  std::vector<double> growths;  ///< outline_growth_px of each camera

  explicit NetworkState(const Network& network);
  void write_to(Network& network) const;
};

/// Copy with cameras, stations, mounts, images, points and bodies only.
Network without_observations(const Network& network);

constexpr Index none = -1;
constexpr int max_columns = Camera::max_parameters + 13;  ///< unknowns of an image
constexpr int max_group = 8;  ///< unknowns of a point with an outline that is not round

/// Free parameters of a camera, followed by the growth of its outlines.
struct CameraBlock {
  Index offset = none;
  std::vector<ParameterColumns> columns;  ///< free parameters
  bool has_growth = false;

  int size() const { return static_cast<int>(columns.size()) + has_growth; }
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

/// Unknowns of an outline: two or three rotations, and one or two logarithms of sizes.
inline int rotations_of(const NetworkOutline& outline) { return outline.is_round ? 2 : 3; }
inline int unknowns_of(const NetworkOutline& outline) { return outline.is_round ? 3 : 5; }
/// World axes of its rotations (3 x 2 or 3 x 3).
Eigen::Matrix3Xd rotation_axes(const NetworkOutline& outline);

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
  std::vector<int> point_sizes;                         ///< 3, or 6 or 8 with an outline
  std::vector<int> outline_of;  ///< outline of each image observation or none; empty: no outlines
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
  int size_of(const Target& target) const {
    return target.body < 0 ? point_sizes[target.point] : body_sizes[target.body];
  }
  /// Outline of an image observation; nothing if it has none, or if its outline is not unknown.
  const OutlineObservation* outline(const Network& network, int observation) const {
    if (outline_of.empty() || outline_of[observation] < 0) return nullptr;
    return &network.outlines[outline_of[observation]];
  }
};

NetworkLayout layout_of(const Network& network);

/// Position of a target [m], and its derivative with respect to the target's own unknowns. Those of
/// a body: rotation vector about its origin, translation, logarithm of the scale. Those of a point:
/// position, then rotation and logarithms of the sizes of its outline.
Eigen::Vector3d target_position(const Network& network, const NetworkState& state,
                                const Target& target);
Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, max_group> target_jacobian(
    const Network& network, const NetworkLayout& layout, const NetworkState& state,
    const Target& target);

/// State after a step; nothing when a camera model rejects the new parameters.
std::optional<NetworkState> apply_step(const NetworkLayout& layout, const NetworkState& state,
                                       const Eigen::VectorXd& step);

}  // namespace occ::internal::network
