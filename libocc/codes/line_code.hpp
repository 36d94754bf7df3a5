// SPDX-License-Identifier: Apache-2.0
// Line codes: map bits to chips, lit (1) or dark (0), so that a lamp is lit half of the time for
// any data and never long in one state.
//
//   manchester   1 -> 10, 0 -> 01               runs of 2 chips at most
//   code_4b6b    four bits -> six chips, three of them lit, by the table of IEEE 802.15.7-2011
//                (clause 10, "4B6B encoding"): runs of 4 at most
#pragma once

#include <cstdint>
#include <vector>

#include "libocc/codes/crc.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Line codes of c_ook.
enum class LineCode {
  manchester,  ///< 1 bit in 2 chips
  code_4b6b,   ///< 4 bits in 6 chips: a third faster
};

using Chips = std::vector<std::uint8_t>;  ///< each 0 or 1

LIBOCC_API int bits_per_word(LineCode code);   ///< 1 or 4
LIBOCC_API int chips_per_word(LineCode code);  ///< 2 or 6

/// Returns the chips of a word of bits_per_word bits. Throws std::invalid_argument for a larger
/// word.
LIBOCC_API Chips word_chips(LineCode code, std::uint32_t word);

}  // namespace occ
