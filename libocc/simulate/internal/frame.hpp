// SPDX-License-Identifier: Apache-2.0
// What one image is rendered from.
#pragma once

#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/internal/storage.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ::internal::simulate {

struct Frame {
  const Scene& scene;
  const Rigid3& cam_from_world;
  const SimulateOptions& options;
  const RenderPlan& plan;
  Storage& storage;
};

/// Without distortion when the plan leaves it out.
inline Camera rendered_camera(const Frame& frame) {
  const Camera& camera = frame.scene.camera;
  return frame.plan.applies(Effect::distortion) ? camera : camera.without_distortion();
}

}  // namespace occ::internal::simulate
