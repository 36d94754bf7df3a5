// SPDX-License-Identifier: Apache-2.0
// Makes the plan of one image and checks the position of the camera.
#pragma once

#include <algorithm>

#include "libocc/simulate/internal/scene_view.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ::internal::simulate {

/// Decides for each effect whether the image contains it. `view` may be null if no use of an effect
/// depends on bounds; all bounds are 0 then.
RenderPlan make_plan(const Scene& scene, const SimulateOptions& options, const SceneView* view);

/// True if the plan depends on bounds and therefore on the pose.
inline bool depends_on_bounds(const Effects& effects) {
  return std::find(effects.use.begin(), effects.use.end(), Use::automatic) != effects.use.end();
}

/// Throws std::invalid_argument, naming the object, if the camera is inside a box or on a lamp.
void check_camera_position(const Scene& scene, const Eigen::Vector3d& camera_position);

/// Throws std::invalid_argument if the camera is outside the room whose walls are rendered.
void check_inside_room(const Eigen::Vector3d& size_m, const Eigen::Vector3d& camera_position);

}  // namespace occ::internal::simulate
