// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/s2psk.hpp"

#include <cmath>

namespace occ {
namespace {

int whole_periods(const Code& code) {  // of a frame
  return static_cast<int>(std::floor(code.min_hz / code.frame_rate_hz - 0.75)) + 1;
}

// Slots are an odd number of half periods long, so that every other one begins with the reference
// dark.
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

}  // namespace occ
