// SPDX-License-Identifier: Apache-2.0
// Camera on-off keying. A rolling shutter sees a lamp through as many rows as its image is high, a
// few milliseconds out of every frame, so that a packet comes in pieces:
//
//   sub-packet   preamble | sequence number | four bits
//   period       sub-packet 0 `repeats` times, sub-packet 1 `repeats` times, ...
//
// Preambles of IEEE 802.15.7-2018: 011100 before Manchester, 0011111000 before 4B6B; they have runs
// that the line codes cannot have. An image that holds a sub-packet's chips, from wherever in it,
// holds it whole, as its repeats close the circle.
#pragma once

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

LIBOCC_API Chips c_ook_preamble(LineCode line);

LIBOCC_API int c_ook_sub_packets(const Code& code);    ///< four bits each
LIBOCC_API int c_ook_sequence_bits(const Code& code);  ///< of a sequence number
LIBOCC_API int c_ook_sub_packet_chips(const Code& code);

/// The whole period; sequence numbers are known.
LIBOCC_API SlotCode c_ook_slots(const Code& code);

/// One sub-packet without end, its symbols those of the sequence number, then of its bits.
LIBOCC_API SlotCode c_ook_sub_packet_slots(const Code& code);

}  // namespace occ
