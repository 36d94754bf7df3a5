// SPDX-License-Identifier: Apache-2.0
// Internal: which colour a mosaic's pixels see.
#pragma once

#include <cstddef>

#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::radiometry {

/// Of the pixels at a place in the tile of two by two, x + 2 y: 0 red, 1 green, 2 blue; without a
/// mosaic all are as green ones.
std::size_t colour_at(Mosaic mosaic, std::size_t place);

}  // namespace occ::internal::radiometry
