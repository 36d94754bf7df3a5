// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/c_ook.hpp"

namespace occ {
namespace {

SlotPattern pattern_of(const Chips& chips) { return {{chips.begin(), chips.end()}}; }

// Pattern 0 is the preamble, pattern 1 + w the word w.
constexpr int first_word = 1;

SlotCode empty_code(const Code& code) {
  SlotCode slots;
  slots.chip_rate_hz = code.clock_hz;
  slots.bits_per_symbol = bits_per_word(code.line);
  slots.patterns.push_back(pattern_of(c_ook_preamble(code.line)));
  for (int word = 0; word < slots.alphabet(); ++word)
    slots.patterns.push_back(pattern_of(word_chips(code.line, static_cast<std::uint32_t>(word))));
  return slots;
}

}  // namespace

Chips c_ook_preamble(LineCode line) {
  if (line == LineCode::manchester) return {0, 1, 1, 1, 0, 0};
  return {0, 0, 1, 1, 1, 1, 1, 0, 0, 0};
}

int c_ook_sub_packets(const Code& code) {
  return (code.id_bits + checksum_bits(code.checksum)) / 4;
}

int c_ook_sequence_bits(const Code& code) {
  if (code.line == LineCode::code_4b6b) return 4;
  int bits = 1;
  while (1 << bits < c_ook_sub_packets(code)) ++bits;
  return bits;
}

int c_ook_sub_packet_chips(const Code& code) {
  const int words = (c_ook_sequence_bits(code) + 4) / bits_per_word(code.line);
  return static_cast<int>(c_ook_preamble(code.line).size()) + words * chips_per_word(code.line);
}

SlotCode c_ook_slots(const Code& code) {
  SlotCode slots = empty_code(code);
  const int words = 4 / slots.bits_per_symbol;
  for (int number = 0; number < c_ook_sub_packets(code); ++number) {
    const Bits sequence = bits_of(static_cast<std::uint32_t>(number), c_ook_sequence_bits(code));
    for (int repeat = 0; repeat < code.repeats; ++repeat) {
      slots.add_slot(-1, 0);
      for (const int word : symbols_of(sequence, slots.bits_per_symbol))
        slots.add_slot(-1, first_word + word);
      for (int i = 0; i < words; ++i) slots.add_slot(number * words + i, first_word);
    }
  }
  slots.symbols = c_ook_sub_packets(code) * words;
  return slots;
}

SlotCode c_ook_sub_packet_slots(const Code& code) {
  SlotCode slots = empty_code(code);
  slots.symbols = (c_ook_sequence_bits(code) + 4) / slots.bits_per_symbol;
  slots.add_slot(-1, 0);
  for (int i = 0; i < slots.symbols; ++i) slots.add_slot(i, first_word);
  return slots;
}

}  // namespace occ
