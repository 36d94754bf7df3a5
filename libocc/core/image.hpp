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

/// Number format of a channel value.
enum class PixelType {
  u8,   ///< 0 to 255
  u16,  ///< 0 to 65535, native byte order
};

/// Non-owning view of a grey (1 channel) or colour (3 or 4 interleaved channels) image. The first
/// three channels are red, green and blue; reverse them in images of OpenCV, which are BGR. Where
/// colours are not compared, an image is read as grey (c0 + 2 c1 + c2 + 2) / 4 rounded down, the
/// same for both orders. A fourth channel is ignored.
struct ImageView {
  const void* data = nullptr;      ///< first byte of the first row; not owned
  int width = 0;                   ///< [px]
  int height = 0;                  ///< [px]
  int channels = 1;                ///< 1, 3 or 4, interleaved
  PixelType type = PixelType::u8;  ///< format of each channel value
  std::size_t row_bytes = 0;       ///< bytes from one row to the next

  /// Throws std::invalid_argument when the view cannot be an image (null, empty, 2 channels, rows
  /// that overlap, 16-bit pixels at odd addresses). The message contains `name`.
  LIBOCC_API void validate(const std::string& name = "image") const;
};

/// Owning grey image, rows without padding. 8-bit pixels are stored in `u8`, deeper ones in `u16`.
struct Image {
  int width = 0;                   ///< [px]
  int height = 0;                  ///< [px]
  int channels = 1;                ///< 1, 3 or 4, interleaved
  PixelType type = PixelType::u8;  ///< selects `u8` or `u16`; the other one is empty
  std::vector<std::uint8_t> u8;    ///< width x height x channels values, row by row
  std::vector<std::uint16_t> u16;  ///< width x height x channels values, row by row

  /// Throws std::invalid_argument if the number of pixels does not match the size.
  LIBOCC_API ImageView view() const;
};

/// Grey copy of a view (weights as in ImageView). A grey view is copied unchanged.
LIBOCC_API Image to_grey(const ImageView& image);

}  // namespace occ
