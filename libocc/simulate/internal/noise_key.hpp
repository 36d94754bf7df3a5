// SPDX-License-Identifier: Apache-2.0
// Every random number of an image is a function of (seed, frame, use, pixel), so a pixel's noise
// does not depend on its neighbours, on the lamps elsewhere, or on the order of work.
#pragma once

#include <array>
#include <cstdint>

#include "libocc/core/philox_blocks.hpp"

namespace occ {

/// Second word of the Philox counter, after that which counts pixels. `Random`, which draws the
/// rare pixels that need an exact sampler, has 0 there.
enum NoiseUse : std::uint32_t { dark_use = 1, refine_use = 2, lit_use = 3, gain_use = 4 };

struct NoiseKey {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;

  std::array<std::uint32_t, 2> words() const {
    return {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  }
};

/// Random words of `count` pixels from `first` on, `per_block` pixels sharing a block of four. The
/// first pixel's place in its block is `skip`.
template <std::uint32_t per_block>
class PixelWords {
 public:
  PixelWords(Simd simd, const NoiseKey& key, NoiseUse use, std::uint32_t first,
             std::uint32_t count) {
    const std::uint32_t block = first / per_block;
    const std::uint32_t blocks = (first + count - 1) / per_block - block + 1;
    skip = first % per_block;
    philox_blocks(simd, block, blocks, {use, 0, key.frame}, key.words(), words.data());
  }

  static constexpr std::uint32_t most_blocks = 256;
  static constexpr std::uint32_t most = (most_blocks - 1) * per_block;  ///< of `count`

  std::array<std::uint32_t, 4 * most_blocks + 16> words;  ///< readable a vector beyond the last
  std::uint32_t skip;
};

}  // namespace occ
