// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/internal/mosaic.hpp"

#include <array>

namespace occ::internal::radiometry {

std::size_t colour_at(Mosaic mosaic, std::size_t place) {
  constexpr std::size_t red = 0, green = 1, blue = 2;
  switch (mosaic) {
    case Mosaic::rggb:
      return std::array<std::size_t, 4>{red, green, green, blue}[place];
    case Mosaic::grbg:
      return std::array<std::size_t, 4>{green, red, blue, green}[place];
    case Mosaic::gbrg:
      return std::array<std::size_t, 4>{green, blue, red, green}[place];
    case Mosaic::bggr:
      return std::array<std::size_t, 4>{blue, green, green, red}[place];
    case Mosaic::none:
      break;
  }
  return green;
}

}  // namespace occ::internal::radiometry
