// SPDX-License-Identifier: Apache-2.0
// The image of the room's surfaces. A box in front of one is black.
#pragma once

#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// Adds the electrons that each pixel gets from the surfaces. Throws std::invalid_argument unless
/// the camera is in the room.
void add_room_light(const Frame& frame, Signal& signal);

}  // namespace occ::internal::simulate
