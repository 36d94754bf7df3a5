// SPDX-License-Identifier: Apache-2.0
// Internal: grey levels of an ImageView, read in place. Grey levels of colour images are multiples
// of a quarter, (c0 + 2 c1 + c2) / 4, so levels are handled as integers: grey level times `scale`.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "libocc/core/image.hpp"

namespace occ::internal::detect {

template <typename T, int Channels>
class Pixels {
 public:
  using Value = T;
  static constexpr int channels = Channels;
  static constexpr int scale = Channels == 1 ? 1 : 4;

  explicit Pixels(const ImageView& view)
      : data_(static_cast<const unsigned char*>(view.data)),
        row_bytes_(view.row_bytes),
        width_(view.width),
        height_(view.height) {}

  int width() const { return width_; }
  int height() const { return height_; }

  const T* row(int y) const {
    return reinterpret_cast<const T*>(data_ + static_cast<std::size_t>(y) * row_bytes_);
  }

  /// Grey level times `scale` of pixel x in a row.
  static int level(const T* row, int x) {
    const T* p = row + static_cast<std::ptrdiff_t>(x) * Channels;
    if constexpr (Channels == 1)
      return p[0];
    else
      return p[0] + 2 * p[1] + p[2];
  }

  /// Largest stored value of the colour channels, the first to saturate.
  static int brightest(const T* row, int x) {
    const T* p = row + static_cast<std::ptrdiff_t>(x) * Channels;
    if constexpr (Channels == 1)
      return p[0];
    else
      return std::max(p[0], std::max(p[1], p[2]));
  }

 private:
  const unsigned char* data_;
  std::size_t row_bytes_;
  int width_;
  int height_;
};

/// Calls f with the Pixels<T, Channels> of a (valid) view.
template <typename F>
decltype(auto) visit_pixels(const ImageView& view, F&& f) {
  if (view.type == PixelType::u8) {
    if (view.channels == 1) return std::forward<F>(f)(Pixels<std::uint8_t, 1>(view));
    if (view.channels == 3) return std::forward<F>(f)(Pixels<std::uint8_t, 3>(view));
    return std::forward<F>(f)(Pixels<std::uint8_t, 4>(view));
  }
  if (view.channels == 1) return std::forward<F>(f)(Pixels<std::uint16_t, 1>(view));
  if (view.channels == 3) return std::forward<F>(f)(Pixels<std::uint16_t, 3>(view));
  return std::forward<F>(f)(Pixels<std::uint16_t, 4>(view));
}

}  // namespace occ::internal::detect
