// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "libocc/core/image.hpp"

namespace occ::internal::core {

/// Largest value of any channel of an image with 16-bit pixels.
inline int highest_level(const ImageView& image) {
  int highest = 0;
  for (int y = 0; y < image.height; ++y) {
    const auto* row =
        reinterpret_cast<const std::uint16_t*>(static_cast<const unsigned char*>(image.data) +
                                               static_cast<std::size_t>(y) * image.row_bytes);
    const auto count = static_cast<std::ptrdiff_t>(image.width) * image.channels;
    highest = std::max<int>(highest, *std::max_element(row, row + count));
  }
  return highest;
}

}  // namespace occ::internal::core
