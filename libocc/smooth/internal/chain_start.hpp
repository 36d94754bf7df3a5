// SPDX-License-Identifier: Apache-2.0
// Start values for the poses of a chain.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_problem.hpp"

namespace occ::internal::smooth {

/// Poses that fit the observations of one node alone: all candidates of each image, and observed
/// or known poses. Empty if nothing determines the pose.
template <class Body>
std::vector<typename Body::Pose> poses_alone(const Body& body, const Node<Body>& node);

/// Poses of the linked node `at` from three points in the images of several nodes, whose relative
/// poses follow from the links (generalised P3P). Empty with fewer points.
template <class Body>
std::vector<typename Body::Pose> poses_together(const Chain<Body>& chain, std::size_t at);

/// True if the root mean square of the node's residuals at this pose is below `sigmas`.
template <class Body>
bool fits(const Chain<Body>& chain, std::size_t k, const typename Body::Pose& pose, double sigmas);

}  // namespace occ::internal::smooth
