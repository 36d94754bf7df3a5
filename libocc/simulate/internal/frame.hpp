// SPDX-License-Identifier: Apache-2.0
// What one image is rendered from.
#pragma once

#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/internal/storage.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ {

struct Frame {
  const Scene& scene;
  const Rigid3& cam_from_world;
  const SimulateOptions& options;
  const RenderPlan& plan;
  Storage& storage;
};

}  // namespace occ
