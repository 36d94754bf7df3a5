// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "libocc/scene/scene.hpp"

namespace occ::internal::simulate {

/// A camera inside something that is there sees nothing that could be rendered: throws
/// std::invalid_argument naming the box or the lamp.
void check_place(const Scene& scene, const Eigen::Vector3d& camera_position);

/// The same of a camera that is not in the room whose walls are rendered.
void check_in_room(const Eigen::Vector3d& size_m, const Eigen::Vector3d& camera_position);

}  // namespace occ::internal::simulate
