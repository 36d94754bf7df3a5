// SPDX-License-Identifier: Apache-2.0
// What all codes have in common: a period of slots, each filled with one of a few patterns of
// chips. Slots that say the same symbol are repeats of one another. One decoder reads them all.
#pragma once

#include <vector>

#include "libocc/codes/code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Light by channel and chip.
using SlotPattern = std::vector<std::vector<double>>;

struct Slot {
  int first_chip = 0;
  int symbol = -1;        ///< which one it says; -1: none, its one pattern is known
  int first_pattern = 0;  ///< of SlotCode::patterns; a symbol's value is added
};

struct LIBOCC_API SlotCode {
  double chip_rate_hz = 0;
  int channels = 1;
  int chips = 0;  ///< of the period
  int symbols = 0;
  int bits_per_symbol = 1;
  std::vector<SlotPattern> patterns;
  std::vector<Slot> slots;

  int alphabet() const { return 1 << bits_per_symbol; }
  int slot_chips(std::size_t slot) const;
  void add_slot(int symbol, int first_pattern);  ///< behind the others

  /// The light that says these symbols.
  Waveform waveform(const std::vector<int>& values) const;
};

LIBOCC_API SlotCode slot_code(const Code& code);

LIBOCC_API std::vector<int> symbols_of(const Bits& bits, int bits_per_symbol);

}  // namespace occ
