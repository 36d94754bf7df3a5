// SPDX-License-Identifier: Apache-2.0
// World frame of a survey (survey.hpp).
#pragma once

#include <vector>

#include "libocc/network/datum.hpp"
#include "libocc/survey/internal/lamp_map.hpp"

namespace occ::internal::survey {

/// Directions of the axes, and the scale that sets the distance from the first lamp to the farthest
/// to 1. `order`: lamps of the map in the order of the result.
Similarity world_frame(const LampMap& map, const std::vector<int>& order);

/// Origin in a frame with these axes: mean x and y of the lamps, z of the lowest camera.
Eigen::Vector3d world_origin(const LampMap& map, const std::vector<int>& order);

}  // namespace occ::internal::survey
