// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/slot_code.hpp"

#include <stdexcept>

#include "libocc/codes/code_kinds.hpp"

namespace occ {

int SlotCode::slot_chips(std::size_t slot) const {
  const auto pattern = static_cast<std::size_t>(slots[slot].first_pattern);
  return static_cast<int>(patterns[pattern].front().size());
}

void SlotCode::add_slot(int symbol, int first_pattern) {
  slots.push_back({chips, symbol, first_pattern});
  chips += slot_chips(slots.size() - 1);
}

Waveform SlotCode::waveform(const std::vector<int>& values) const {
  Waveform made;
  made.chip_rate_hz = chip_rate_hz;
  made.chips.resize(static_cast<std::size_t>(channels));
  for (const Slot& slot : slots) {
    const int value = slot.symbol < 0 ? 0 : values[slot.symbol];
    const SlotPattern& pattern = patterns[slot.first_pattern + value];
    for (std::size_t c = 0; c < made.chips.size(); ++c)
      made.chips[c].insert(made.chips[c].end(), pattern[c].begin(), pattern[c].end());
  }
  return made;
}

SlotCode slot_code(const Code& code) {
  code.validate();
  switch (code.kind) {
    case CodeKind::c_ook:
      return c_ook_slots(code);
    case CodeKind::ufsook:
      return ufsook_slots(code);
    case CodeKind::s2psk:
      return s2psk_slots(code);
    case CodeKind::csk:
      return csk_slots(code);
  }
  throw std::invalid_argument("kind is not a CodeKind");
}

std::vector<int> symbols_of(const Bits& bits, int bits_per_symbol) {
  std::vector<int> symbols;
  for (auto at = bits.begin(); at != bits.end(); at += bits_per_symbol)
    symbols.push_back(static_cast<int>(value_of(Bits(at, at + bits_per_symbol))));
  return symbols;
}

}  // namespace occ
