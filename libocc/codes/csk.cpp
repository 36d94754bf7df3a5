// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/csk.hpp"

namespace occ {

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
