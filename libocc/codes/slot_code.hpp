// SPDX-License-Identifier: Apache-2.0
// Common representation of all codes, for one decoder: a period of slots, each filled with one of
// a few patterns of chips. Slots with the same symbol are repeats of one another.
#pragma once

#include <vector>

#include "libocc/codes/code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Light [channel][chip].
using SlotPattern = std::vector<std::vector<double>>;

/// Section of a period that transmits one symbol, or a fixed pattern.
struct Slot {
  int first_chip = 0;     ///< index within the period
  int symbol = -1;        ///< index of its symbol; -1: a fixed, known pattern
  int first_pattern = 0;  ///< index into SlotCode::patterns of symbol value 0
};

/// Period of a code as a list of slots.
struct LIBOCC_API SlotCode {
  double chip_rate_hz = 0;            ///< chips per second
  int channels = 1;                   ///< lamps or colours; see Waveform
  int chips = 0;                      ///< number of chips of the period
  int symbols = 0;                    ///< number of different symbols; slots may repeat them
  int bits_per_symbol = 1;            ///< 1, 2 or 4
  std::vector<SlotPattern> patterns;  ///< light of each possible slot; slots refer to it by index
  std::vector<Slot> slots;            ///< in the order of time

  /// Number of values of a symbol.
  int alphabet() const { return 1 << bits_per_symbol; }
  /// Length of a slot [chips]; `slot` is an index into slots.
  int slot_chips(std::size_t slot) const;
  void add_slot(int symbol, int first_pattern);  ///< appends a slot

  /// Waveform of these symbol values.
  Waveform waveform(const std::vector<int>& values) const;
};

/// Slot code of any kind of code. Throws std::invalid_argument for an invalid code.
LIBOCC_API SlotCode slot_code(const Code& code);

/// Splits bits into symbol values, most significant bit first.
LIBOCC_API std::vector<int> symbols_of(const Bits& bits, int bits_per_symbol);

}  // namespace occ
