// SPDX-License-Identifier: Apache-2.0
// The four kinds of codes as slot codes.
#pragma once

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

// Camera on-off keying. A rolling shutter sees a lamp through as many rows as its image is high, a
// few milliseconds out of every frame, so that a packet comes in pieces:
//
//   sub-packet   preamble | sequence number | four bits
//   period       sub-packet 0 `repeats` times, sub-packet 1 `repeats` times, ...
//
// Preambles of IEEE 802.15.7-2018: 011100 before Manchester, 0011111000 before 4B6B; they have runs
// that the line codes cannot have. An image that holds a sub-packet's chips, from wherever in it,
// holds it whole, as its repeats close the circle.

LIBOCC_API Chips c_ook_preamble(LineCode line);

LIBOCC_API int c_ook_sub_packets(const Code& code);    ///< four bits each
LIBOCC_API int c_ook_sequence_bits(const Code& code);  ///< of a sequence number
LIBOCC_API int c_ook_sub_packet_chips(const Code& code);

/// The whole period; sequence numbers are known.
LIBOCC_API SlotCode c_ook_slots(const Code& code);

/// One sub-packet without end, its symbols those of the sequence number, then of its bits.
LIBOCC_API SlotCode c_ook_sub_packet_slots(const Code& code);

// Undersampled frequency shift on-off keying. A camera of F frames/s sees a lamp that blinks at N F
// (mark, 1) in one state in both frames of a bit, and at (N - 1/2) F (space, 0) in both states in
// turn; both frequencies are above flicker. A packet begins with two frames of mid grey: half the
// light, from a lamp that dims or that pulses several times in an exposure (25 kHz in the paper).

struct UfsookTones {
  double mark_hz, space_hz;
};

/// 120 and 105 Hz at 30 frames/s.
LIBOCC_API UfsookTones ufsook_tones(const Code& code);

LIBOCC_API SlotCode ufsook_slots(const Code& code);

// Spatial two-phase shift keying. A reference lamp blinks steadily; beside it, the lamp that says
// the id is in phase with it (0) or in antiphase (1) for two frames a bit. One frame shows which,
// whatever its phase, and the two frames of a bit are a quarter period apart, so that not both can
// fall on the edges. The lamp begins a packet with one or two bits of mid grey (an even number of
// slots in all; see codes/ufsook.hpp). Channel 0 is the lamp, channel 1 its reference.

/// Frequency of the reference: (k + 3/4) F, 112.5 Hz at 30 frames/s.
LIBOCC_API double s2psk_hz(const Code& code);

LIBOCC_API SlotCode s2psk_slots(const Code& code);

// Colour-shift keying by channel: a lamp of a red, a green and a blue emitter says two bits with
// one of four colours of the same power: red (00), green (01), blue (10), a third of each (11). A
// packet begins dark, which no symbol is, then red, green, blue: from these the decoder learns what
// each of the sensor's channels gets of each emitter (crosstalk), whatever the filters are.

LIBOCC_API SlotCode csk_slots(const Code& code);

}  // namespace occ
