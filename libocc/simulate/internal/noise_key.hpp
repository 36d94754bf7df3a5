// SPDX-License-Identifier: Apache-2.0
// Random numbers of an image by a counter-based generator (Philox). Each is a function of (seed,
// frame, use, pixel), so a pixel's noise does not depend on lamps elsewhere or on the order of
// computation.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "libocc/core/internal/philox_blocks.hpp"

namespace occ::internal::simulate {

/// Second word of the Philox counter; the first word counts pixels. 0 is used by `Random`, which
/// draws the rare pixels that need an exact sampler.
enum NoiseUse : std::uint32_t {
  dark_use = 1,
  refine_use = 2,
  lit_use = 3,
  gain_use = 4,
  target_use = 5
};

struct NoiseKey {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;

  bool operator==(const NoiseKey& other) const {
    return seed == other.seed && frame == other.frame;
  }

  std::array<std::uint32_t, 2> words() const {
    return {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  }
};

/// `count` pixels in each of `rows` rows. The first row begins with pixel `first`, each further row
/// `next_row` pixels after the one before.
struct NoisyPixels {
  std::uint32_t first, count, next_row, rows;
};

/// Random words of pixels. `per_block` pixels share a block of four words, and the first pixel has
/// the index `skip` in its block. One vector more than the pixels' words can be read.
struct RandomWords {
  const std::uint32_t* words;
  std::uint32_t skip;
};

/// Draws random words for several rows at a time, because one row of a lamp's image would leave
/// most of a vector of blocks unused.
template <std::uint32_t per_block>
class RowWords {
 public:
  explicit RowWords(NoiseUse use) : use_(use) {}

  /// Random words of the first of the rows, valid until the next call. The words of the other rows
  /// are drawn as well, because they are usually needed next.
  RandomWords of(Simd simd, const NoiseKey& key, const NoisyPixels& pixels) {
    const std::uint32_t row = pixels.next_row > 0 ? (pixels.first - first_) / pixels.next_row : 0;
    const bool known = row < begins_.size() && key == key_ && pixels.count == count_ &&
                       pixels.next_row == next_row_ && first_ + row * next_row_ == pixels.first;
    if (!known) draw(simd, key, pixels);
    return {words_.data() + begins_[known ? row : 0], pixels.first % per_block};
  }

 private:
  static constexpr std::uint32_t padding = 32;
  static constexpr std::uint32_t usual_blocks = 8 * core::philox_batch;

  void draw(Simd simd, const NoiseKey& key, const NoisyPixels& pixels) {
    key_ = key;
    first_ = pixels.first;
    count_ = pixels.count;
    next_row_ = pixels.next_row;
    begins_.clear();
    const std::uint32_t max_row = pixels.count / per_block + 2;  // blocks of a row
    counters_.resize(std::max(usual_blocks, max_row) + core::philox_batch);
    std::uint32_t blocks = 0;
    for (std::uint32_t row = 0; row < pixels.rows; ++row) {
      if (row > 0 && blocks + max_row > usual_blocks) break;
      begins_.push_back(4 * blocks);
      const std::uint32_t first = pixels.first + row * pixels.next_row;
      const std::uint32_t block = first / per_block;
      const std::uint32_t in_row = (first + pixels.count - 1) / per_block - block + 1;
      const auto begin = counters_.begin() + blocks;
      std::iota(begin, begin + in_row, block);
      blocks += in_row;
    }
    words_.resize(4 * counters_.size() + padding);
    core::philox_blocks(simd, counters_.data(), blocks, {use_, 0, key.frame}, key.words(),
                        words_.data());
  }

  NoiseUse use_;
  NoiseKey key_;
  std::uint32_t first_ = 0, count_ = 0, next_row_ = 0;
  std::vector<std::uint32_t> begins_;  // index in words_ at which each row begins
  std::vector<std::uint32_t> counters_, words_;
};

}  // namespace occ::internal::simulate
