// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/code_kinds.hpp"

#include <cmath>

namespace occ {

// Camera on-off keying

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

// Undersampled frequency shift on-off keying

namespace {

// Slowest clock for which the half periods of both tones are whole numbers of chips.
struct Division {
  int n;           // mark_hz / frame_rate_hz
  int half_mark;   // half a period of the mark [chips]
  int half_space;  // half a period of the space [chips]
  int slot;        // two frames [chips]

  explicit Division(const Code& code)
      : n(static_cast<int>(std::floor(code.min_hz / code.frame_rate_hz + 0.5)) + 1),
        half_mark(2 * n - 1),
        half_space(2 * n),
        slot(4 * n * half_mark) {}
};

SlotPattern square(int chips, int half_period) {
  SlotPattern made(1);
  for (int i = 0; i < chips; ++i) made[0].push_back((i / half_period) % 2 == 0 ? 1 : 0);
  return made;
}

}  // namespace

UfsookTones ufsook_tones(const Code& code) {
  code.validate();
  const Division division(code);
  const double chip_rate_hz = division.slot * code.frame_rate_hz / 2;
  return {chip_rate_hz / (2 * division.half_mark), chip_rate_hz / (2 * division.half_space)};
}

SlotCode ufsook_slots(const Code& code) {
  const Division division(code);
  SlotCode slots;
  slots.chip_rate_hz = division.slot * code.frame_rate_hz / 2;
  slots.symbols = code.id_bits + checksum_bits(code.checksum);
  const SlotPattern delimiter{std::vector<double>(static_cast<std::size_t>(division.slot), 0.5)};
  slots.patterns = {delimiter, square(division.slot, division.half_space),
                    square(division.slot, division.half_mark)};
  slots.add_slot(-1, 0);
  for (int i = 0; i < slots.symbols; ++i) slots.add_slot(i, 1);
  return slots;
}

// Spatial two-phase shift keying

namespace {

/// Whole periods of the reference in one frame.
int whole_periods(const Code& code) {
  return static_cast<int>(std::floor(code.min_hz / code.frame_rate_hz - 0.75)) + 1;
}

// Slots are an odd number of half periods long, so every second slot begins with a dark reference.
SlotPattern pattern(int half_periods, bool begins_lit, bool antiphase, bool grey) {
  SlotPattern made(2);
  for (int i = 0; i < half_periods; ++i) {
    const bool reference = (i % 2 == 0) == begins_lit;
    made[0].push_back(grey ? 0.5 : reference != antiphase);
    made[1].push_back(reference);
  }
  return made;
}

}  // namespace

double s2psk_hz(const Code& code) {
  code.validate();
  return code.frame_rate_hz * (whole_periods(code) + 0.75);
}

SlotCode s2psk_slots(const Code& code) {
  const int half_periods = 4 * whole_periods(code) + 3;
  SlotCode slots;
  slots.chip_rate_hz = 2 * s2psk_hz(code);
  slots.channels = 2;
  slots.symbols = code.id_bits + checksum_bits(code.checksum);
  for (const bool begins_lit : {true, false}) {
    slots.patterns.push_back(pattern(half_periods, begins_lit, false, true));
    slots.patterns.push_back(pattern(half_periods, begins_lit, false, false));
    slots.patterns.push_back(pattern(half_periods, begins_lit, true, false));
  }
  const auto add = [&](int symbol) {
    const int odd = static_cast<int>(slots.slots.size() % 2);
    slots.add_slot(symbol, 3 * odd + (symbol < 0 ? 0 : 1));
  };
  for (int i = 0; i < 2 - slots.symbols % 2; ++i) add(-1);
  for (int i = 0; i < slots.symbols; ++i) add(i);
  return slots;
}

// Colour-shift keying

SlotCode csk_slots(const Code& code) {
  SlotCode slots;
  slots.chip_rate_hz = code.clock_hz;
  slots.channels = 3;
  slots.bits_per_symbol = 2;
  slots.symbols = (code.id_bits + checksum_bits(code.checksum)) / 2;
  const double third = 1.0 / 3;
  slots.patterns = {{{1}, {0}, {0}},
                    {{0}, {1}, {0}},
                    {{0}, {0}, {1}},
                    {{third}, {third}, {third}},
                    {{0}, {0}, {0}}};
  constexpr int red = 0, green = 1, blue = 2, dark = 4;
  for (const int colour : {dark, red, green, blue}) slots.add_slot(-1, colour);
  for (int i = 0; i < slots.symbols; ++i) slots.add_slot(i, red);
  return slots;
}

}  // namespace occ
