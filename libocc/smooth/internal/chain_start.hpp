// SPDX-License-Identifier: Apache-2.0
// Internal: where the search for the poses of a chain starts.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_problem.hpp"

namespace occ::internal::smooth {

/// From what one node saw alone; of several poses that fit, the one nearest to `expected`.
template <class Body>
std::optional<typename Body::Pose> pose_alone(const Body& body, const Node<Body>& node,
                                              const typename Body::Pose* expected);

/// Of every node: alone where that is possible, otherwise along the links from its neighbours.
template <class Body>
std::vector<typename Body::Pose> start_poses(const Chain<Body>& chain);

/// Whether the node's sightings are within some sigmas (root mean square) at this pose.
template <class Body>
bool fits(const Body& body, const Node<Body>& node, const typename Body::Pose& pose, double sigmas);

}  // namespace occ::internal::smooth
