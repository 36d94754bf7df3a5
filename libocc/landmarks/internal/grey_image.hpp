// SPDX-License-Identifier: Apache-2.0
// Internal: a grey image with bilinear interpolation, and its 8-bit copy for other libraries.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ::internal::landmarks {

/// View of an image with one channel; the image must outlive it.
class GreyImage {
 public:
  explicit GreyImage(const Image& image) : image_(image) {}

  int width() const { return image_.width; }
  int height() const { return image_.height; }

  double pixel(int x, int y) const {
    const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                   static_cast<std::size_t>(x);
    return image_.type == PixelType::u8 ? image_.u8[i] : image_.u16[i];
  }

  /// True if `px` is inside the image, at least `margin` pixels from its border, so that at(px) is
  /// defined.
  bool holds(const Eigen::Vector2d& px, double margin = 0) const {
    return px.x() >= margin && px.y() >= margin && px.x() < image_.width - 1 - margin &&
           px.y() < image_.height - 1 - margin;
  }

  /// Bilinear interpolation.
  double at(const Eigen::Vector2d& px) const {
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    const double u = px.x() - x, v = px.y() - y;
    return (1 - v) * ((1 - u) * pixel(x, y) + u * pixel(x + 1, y)) +
           v * ((1 - u) * pixel(x, y + 1) + u * pixel(x + 1, y + 1));
  }

 private:
  const Image& image_;
};

/// Level that maps to 255 in eight_bits(): 255 for 8-bit images, else the brightest pixel (1 at
/// least).
inline unsigned white_level(const Image& grey) {
  if (grey.type == PixelType::u8) return 255;
  return std::max<unsigned>(1, *std::max_element(grey.u16.begin(), grey.u16.end()));
}

/// Copy with 8 bits per pixel; 16-bit pixels are scaled so that `white` becomes 255.
inline std::vector<std::uint8_t> eight_bits(const Image& grey, unsigned white) {
  if (grey.type == PixelType::u8) return grey.u8;
  std::vector<std::uint8_t> pixels;
  pixels.reserve(grey.u16.size());
  for (const unsigned value : grey.u16)
    pixels.push_back(static_cast<std::uint8_t>(255 * value / white));
  return pixels;
}

}  // namespace occ::internal::landmarks
