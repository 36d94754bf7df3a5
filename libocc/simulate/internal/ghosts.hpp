// SPDX-License-Identifier: Apache-2.0
// A ghost as a view of its own: rendering that scene from that pose gives the ghost's light.
#pragma once

#include "libocc/scene/scene.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::internal::simulate {

struct GhostView {
  Scene scene;
  Rigid3 cam_from_world;
  SimulateOptions options;
};
GhostView ghost_view(const Scene& scene, const Rigid3& cam_from_world,
                     const SimulateOptions& options, const Ghost& ghost);

}  // namespace occ::internal::simulate
