// SPDX-License-Identifier: Apache-2.0
// Undersampled frequency shift on-off keying. A camera of F frames/s sees a lamp that blinks at N F
// (mark, 1) in one state in both frames of a bit, and at (N - 1/2) F (space, 0) in both states in
// turn; both frequencies are above flicker. A packet begins with two frames of mid grey: half the
// light, from a lamp that dims or that pulses several times in an exposure (25 kHz in the paper).
#pragma once

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

struct UfsookTones {
  double mark_hz, space_hz;
};

/// 120 and 105 Hz at 30 frames/s.
LIBOCC_API UfsookTones ufsook_tones(const Code& code);

LIBOCC_API SlotCode ufsook_slots(const Code& code);

}  // namespace occ
