// SPDX-License-Identifier: Apache-2.0
// Images. `ImageView` refers to pixels of another owner (a numpy array, a cv::Mat, a driver's
// buffer) without copying; `Image` owns its pixels. Pixel (0, 0) is the *centre* of the first
// pixel, x runs along a row, y down the rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

enum class PixelType { u8, u16 };

/// Non-owning view of a grey (1 channel) or colour (3 or 4 interleaved channels) image. Colour is
/// read as grey (c0 + 2 c1 + c2 + 2) / 4 rounded down, the same for RGB and BGR; a fourth channel
/// is ignored.
struct ImageView {
  const void* data = nullptr;
  int width = 0;
  int height = 0;
  int channels = 1;
  PixelType type = PixelType::u8;
  std::size_t row_bytes = 0;  ///< bytes from one row to the next

  /// Throws std::invalid_argument when the view cannot be an image (null, empty, 2 channels, rows
  /// that overlap, 16-bit pixels at odd addresses). The message contains `name`.
  LIBOCC_API void validate(const std::string& name = "image") const;
};

/// Owning grey image, rows without padding. 8-bit pixels are stored in `u8`, deeper ones in `u16`.
struct Image {
  int width = 0;
  int height = 0;
  int channels = 1;
  PixelType type = PixelType::u8;
  std::vector<std::uint8_t> u8;
  std::vector<std::uint16_t> u16;

  /// Throws std::invalid_argument if the number of pixels does not match the size.
  LIBOCC_API ImageView view() const;
};

/// Grey copy of a view (weights as in ImageView). A grey view is copied unchanged.
LIBOCC_API Image to_grey(const ImageView& image);

}  // namespace occ
