// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "libocc/core/require.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::photometry {

/// Throws std::invalid_argument unless there is a rigid pose for each image.
inline void validate_poses(std::size_t images, const std::vector<Rigid3>& cam_from_world) {
  require(images == cam_from_world.size(), "cam_from_world", cam_from_world.size(),
          "one pose for each of " + std::to_string(images) + " images");
  for (std::size_t i = 0; i < cam_from_world.size(); ++i)
    Rigid3::from_matrix(cam_from_world[i].matrix(),
                        ("cam_from_world[" + std::to_string(i) + "]").c_str());
}

}  // namespace occ::internal::photometry
