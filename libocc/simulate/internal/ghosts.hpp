// SPDX-License-Identifier: Apache-2.0
// A ghost as a view of its own: rendering that scene from that pose gives the ghost's light.
#pragma once

#include "libocc/simulate/internal/frame.hpp"

namespace occ {

struct GhostView {
  Scene scene;
  Rigid3 cam_from_world;
  SimulateOptions options;
};
GhostView ghost_view(const Frame& frame, const Ghost& ghost);

}  // namespace occ
