// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/srgb.hpp"

#include <array>
#include <cstdint>

namespace occ::internal::core {

std::optional<Image> linear_grey(const ImageView& image) {
  if (!is_srgb(image)) return std::nullopt;
  std::array<std::uint32_t, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i)
    linear[i] =
        static_cast<std::uint32_t>(std::lround(65535 * srgb_decode(static_cast<double>(i) / 255)));
  Image grey;
  grey.width = image.width;
  grey.height = image.height;
  grey.type = PixelType::u16;
  grey.u16.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    const auto* p = static_cast<const std::uint8_t*>(image.data) +
                    static_cast<std::size_t>(y) * image.row_bytes;
    for (int x = 0; x < image.width; ++x, p += image.channels)
      grey.u16.push_back(
          static_cast<std::uint16_t>((linear[p[0]] + 2 * linear[p[1]] + linear[p[2]] + 2) / 4));
  }
  return grey;
}

}  // namespace occ::internal::core
