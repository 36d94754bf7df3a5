// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/line_code.hpp"

#include <algorithm>
#include <array>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

// Six chips each, the first one in the highest bit.
constexpr std::array<std::uint32_t, 16> words_4b6b{
    0b001110, 0b001101, 0b010011, 0b010110, 0b010101, 0b100011, 0b100110, 0b100101,
    0b011001, 0b011010, 0b011100, 0b110001, 0b110010, 0b101001, 0b101010, 0b101100};

std::uint32_t coded(LineCode code, std::uint32_t word) {
  if (code == LineCode::manchester) return word ? 0b10 : 0b01;
  return words_4b6b[word];
}

}  // namespace

int bits_per_word(LineCode code) { return code == LineCode::manchester ? 1 : 4; }
int chips_per_word(LineCode code) { return code == LineCode::manchester ? 2 : 6; }

Chips word_chips(LineCode code, std::uint32_t word) {
  const std::uint32_t words = 1u << bits_per_word(code);
  require(word < words, "word", word, "below " + std::to_string(words));
  return bits_of(coded(code, word), chips_per_word(code));
}

Chips line_encode(LineCode code, const Bits& bits) {
  const int word_bits = bits_per_word(code);
  require(bits.size() % static_cast<std::size_t>(word_bits) == 0, "bits", bits.size(),
          "a multiple of " + std::to_string(word_bits));
  Chips chips;
  for (auto at = bits.begin(); at != bits.end(); at += word_bits) {
    const Chips word = word_chips(code, value_of(Bits(at, at + word_bits)));
    chips.insert(chips.end(), word.begin(), word.end());
  }
  return chips;
}

std::optional<Bits> line_decode(LineCode code, const Chips& chips) {
  const int word_size = chips_per_word(code);
  require(chips.size() % static_cast<std::size_t>(word_size) == 0, "chips", chips.size(),
          "a multiple of " + std::to_string(word_size));
  Bits bits;
  for (auto at = chips.begin(); at != chips.end(); at += word_size) {
    const std::uint32_t seen = value_of(Chips(at, at + word_size));
    std::uint32_t word = 0;
    while (word < 1u << bits_per_word(code) && coded(code, word) != seen) ++word;
    if (word == 1u << bits_per_word(code)) return std::nullopt;
    const Bits read = bits_of(word, bits_per_word(code));
    bits.insert(bits.end(), read.begin(), read.end());
  }
  return bits;
}

int longest_run(const Chips& chips) {
  const std::size_t n = chips.size();
  int longest = 0, run = 0;
  for (std::size_t i = 0; i < 2 * n; ++i) {
    run = i > 0 && chips[i % n] == chips[(i - 1) % n] ? run + 1 : 1;
    longest = std::max(longest, run);
  }
  return std::min(longest, static_cast<int>(n));
}

}  // namespace occ
