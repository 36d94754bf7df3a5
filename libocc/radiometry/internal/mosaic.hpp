// SPDX-License-Identifier: Apache-2.0
// Internal: colours of the pixels of a colour filter array.
#pragma once

#include <cstddef>

#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::radiometry {

/// Colour of the pixels at position x + 2 y in the tile of 2 x 2 pixels: 0 red, 1 green, 2 blue; 1
/// without a mosaic.
std::size_t colour_at(Mosaic mosaic, std::size_t place);

}  // namespace occ::internal::radiometry
