// SPDX-License-Identifier: Apache-2.0
// The curve of IEC 61966-2-1:1999, by which most pictures are stored.
#pragma once

#include <cmath>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ::internal::core {

/// Stored value of a linear one, both 0..1. The lowest part is a straight line through zero.
inline double srgb_encode(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// Linear value of a stored one.
inline double srgb_decode(double stored) {
  return stored <= 0.04045 ? stored / 12.92 : std::pow((stored + 0.055) / 1.055, 2.4);
}

/// True for 8-bit images with three colours, which are sRGB unless their source says otherwise.
inline bool is_srgb(const ImageView& image) {
  return image.channels >= 3 && image.type == PixelType::u8;
}

/// Grey image of 16 bits in linear light; empty unless is_srgb(). An edge is where the light is
/// halfway between both sides: halfway between the stored values, it is shifted towards the dark
/// side by about half the blur.
LIBOCC_API std::optional<Image> linear_grey(const ImageView& image);

}  // namespace occ::internal::core
