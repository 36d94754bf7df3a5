// SPDX-License-Identifier: Apache-2.0
// Finds the pixels of a row that exceed a threshold. Most of an image of lamps is dark,
// so the run time is that of skipping blocks without a bright pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {

/// Returns the start of the first block of 64 values, counted from `from`, that contains a value
/// above the limit; `count` when there is none. The last block may be shorter.
int first_block_above(const std::uint8_t* values, int from, int count, std::uint8_t limit);
int first_block_above(const std::uint16_t* values, int from, int count, std::uint16_t limit);

/// Returns 64 bits; bit i is set if values[i] > limit.
std::uint64_t bits_above(const std::uint8_t* values, std::uint8_t limit);

/// Limit for single channels: if the pixel's level exceeds the threshold, one of its channels
/// exceeds this limit, because a grey level is at most the brightest channel. (A fourth channel
/// above the limit costs only time.)
template <typename P>
typename P::Value channel_limit(int threshold) {
  constexpr int highest = std::numeric_limits<typename P::Value>::max();
  const int limit = threshold < 0 ? 0 : threshold / P::scale;
  return static_cast<typename P::Value>(limit < highest ? limit : highest);
}

/// Returns the bright pixels of a row: bit i is set if P::level > threshold at x0 + i; count <= 64.
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
