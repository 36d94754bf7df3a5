// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/ufsook.hpp"

#include <cmath>

namespace occ {
namespace {

// The slowest clock of which half periods of both tones are whole numbers of chips.
struct Division {
  int n;          // mark_hz over the frame rate
  int half_mark;  // chips of half a period
  int half_space;
  int slot;  // chips of two frames

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

}  // namespace occ
