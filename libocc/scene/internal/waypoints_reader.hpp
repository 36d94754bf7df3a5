// SPDX-License-Identifier: Apache-2.0
// Reads waypoints in YAML (libocc-trajectory/1). The keys are listed in
// data/trajectories/README.md.
#pragma once

#include <string>

#include "libocc/scene/trajectory.hpp"

namespace occ::internal::scene {

/// True if the first line that is not a comment has a colon; a line in TUM's format has none.
bool holds_waypoints(const std::string& text);

/// Throws std::runtime_error "FILE:LINE: key `PATH`: REASON, got VALUE".
Trajectory parse_waypoints(const std::string& text, const std::string& name);

}  // namespace occ::internal::scene
