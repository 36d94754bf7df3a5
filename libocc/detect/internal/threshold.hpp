// SPDX-License-Identifier: Apache-2.0
// Internal: which pixels of a row are brighter than a threshold. Nearly all of an image of lamps is
// dark, so what counts is how fast a stretch without any bright pixel is passed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {

/// Start of the first block of 64 values, counted from `from`, that holds a value above the limit;
/// `count` when there is none. The last block may be shorter.
int first_block_above(const std::uint8_t* values, int from, int count, std::uint8_t limit);
int first_block_above(const std::uint16_t* values, int from, int count, std::uint16_t limit);

/// Bit i is set when values[i] > limit, of 64 values.
std::uint64_t bits_above(const std::uint8_t* values, std::uint8_t limit);

/// A limit that no channel of a pixel exceeds unless the pixel's level could exceed the threshold:
/// a grey level is at most the brightest channel. (A fourth channel above it costs time only.)
template <typename P>
typename P::Value channel_limit(int threshold) {
  constexpr int highest = std::numeric_limits<typename P::Value>::max();
  const int limit = threshold < 0 ? 0 : threshold / P::scale;
  return static_cast<typename P::Value>(limit < highest ? limit : highest);
}

/// Bit i is set when pixel x0 + i of the row has P::level > threshold; count <= 64 pixels.
template <typename P>
std::uint64_t bright_pixels(const typename P::Value* row, int x0, int count, int threshold) {
  const auto limit = channel_limit<P>(threshold);
  const typename P::Value* first = row + static_cast<std::ptrdiff_t>(x0) * P::channels;
  if constexpr (P::channels == 1 && sizeof(typename P::Value) == 1) {
    if (count == 64 && threshold >= 0) return bits_above(first, limit);
  }
  if (threshold >= 0 &&
      first_block_above(first, 0, count * P::channels, limit) >= count * P::channels)
    return 0;
  std::uint64_t bits = 0;
  for (int i = 0; i < count; ++i)
    bits |= static_cast<std::uint64_t>(P::level(row, x0 + i) > threshold) << i;
  return bits;
}

}  // namespace occ::internal::detect
