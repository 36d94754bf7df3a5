// SPDX-License-Identifier: Apache-2.0
// Each kind of code as a slot code (see codes/code.hpp for the sources).
#pragma once

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

// Camera on-off keying. A rolling shutter samples a lamp only with the rows of its image, a few
// milliseconds out of every frame. A packet is therefore sent in pieces:
//
//   sub-packet   preamble | sequence number | four bits
//   period       sub-packet 0 `repeats` times, sub-packet 1 `repeats` times, ...
//
// Preambles of IEEE 802.15.7-2018: 011100 before Manchester, 0011111000 before 4B6B. They contain
// runs that are impossible in the line codes. Because sub-packets are repeated, an image with as
// many chips as a sub-packet contains all of it, at any phase.

/// Chips that begin a sub-packet, different for each line code.
LIBOCC_API Chips c_ook_preamble(LineCode line);

LIBOCC_API int c_ook_sub_packets(const Code& code);       ///< number of sub-packets
LIBOCC_API int c_ook_sequence_bits(const Code& code);     ///< bits of a sequence number
LIBOCC_API int c_ook_sub_packet_chips(const Code& code);  ///< chips of a sub-packet

/// Whole period, with known sequence numbers.
LIBOCC_API SlotCode c_ook_slots(const Code& code);

/// One sub-packet, repeated continuously. Symbols: sequence number, then the four bits.
LIBOCC_API SlotCode c_ook_sub_packet_slots(const Code& code);

// Undersampled frequency shift on-off keying. For a camera of F frames/s, a lamp that blinks at N F
// (mark, 1) is in the same state in both frames of a bit; at (N - 1/2) F (space, 0) it is in
// opposite states. Both frequencies are above visible flicker. A packet begins with two frames of
// half the light, from a lamp that dims or that pulses several times during an exposure (25 kHz in
// the paper).

/// Blink frequencies of UFSOOK.
struct UfsookTones {
  double mark_hz, space_hz;  ///< `mark_hz` transmits 1, `space_hz` transmits 0
};

/// Both frequencies; 120 and 105 Hz at 30 frames/s.
LIBOCC_API UfsookTones ufsook_tones(const Code& code);

/// One period: two frames of half the light, then two frames for each bit.
LIBOCC_API SlotCode ufsook_slots(const Code& code);

// Spatial two-phase shift keying. A reference lamp blinks steadily. The lamp beside it, which
// transmits the id, is in phase with it (0) or in antiphase (1) for two frames per bit. One frame
// suffices to decide, unless it falls on an edge of the waveform. The two frames of a bit are a
// quarter period apart, so at most one falls on an edge. The lamp begins a packet with one or two
// bits of half the light, so that the number of slots is even. Channel 0 is the lamp, channel 1 its
// reference.

/// Frequency of the reference: (k + 3/4) F, 112.5 Hz at 30 frames/s.
LIBOCC_API double s2psk_hz(const Code& code);

/// One period of both channels, two frames per bit.
LIBOCC_API SlotCode s2psk_slots(const Code& code);

// Colour-shift keying by channel. A lamp with a red, a green and a blue emitter transmits two bits
// with one of four colours of equal power: red (00), green (01), blue (10), a third of each (11). A
// packet begins with a dark slot, which is no symbol, then red, green and blue. From these the
// decoder estimates the crosstalk: the response of each channel of the sensor to each emitter.

/// One period of three channels, a symbol of two bits per slot after the four reference slots.
LIBOCC_API SlotCode csk_slots(const Code& code);

}  // namespace occ
