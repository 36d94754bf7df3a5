// SPDX-License-Identifier: Apache-2.0
// Start values for the poses of a chain.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_problem.hpp"

namespace occ::internal::smooth {

/// Pose from the observations of one node alone. Of several poses that fit, the one nearest to
/// `expected`, which may be null.
template <class Body>
std::optional<typename Body::Pose> pose_alone(const Body& body, const Node<Body>& node,
                                              const typename Body::Pose* expected);

/// Poses of all nodes: from their own observations if possible, otherwise from their neighbours
/// along the links.
template <class Body>
std::vector<typename Body::Pose> start_poses(const Chain<Body>& chain);

/// True if the root mean square of the node's residuals at this pose is below `sigmas`.
template <class Body>
bool fits(const Body& body, const Node<Body>& node, const typename Body::Pose& pose, double sigmas);

}  // namespace occ::internal::smooth
