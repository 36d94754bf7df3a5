// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/line_code.hpp"

#include <algorithm>
#include <array>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

// Six chips per word, the first one in the highest bit.
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

}  // namespace occ
