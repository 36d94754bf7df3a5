// SPDX-License-Identifier: Apache-2.0
// Spatial two-phase shift keying. A reference lamp blinks steadily; beside it, the lamp that says
// the id is in phase with it (0) or in antiphase (1) for two frames a bit. One frame shows which,
// whatever its phase, and the two frames of a bit are a quarter period apart, so that not both can
// fall on the edges. The lamp begins a packet with one or two bits of mid grey (an even number of
// slots in all; see codes/ufsook.hpp). Channel 0 is the lamp, channel 1 its reference.
#pragma once

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Frequency of the reference: (k + 3/4) F, 112.5 Hz at 30 frames/s.
LIBOCC_API double s2psk_hz(const Code& code);

LIBOCC_API SlotCode s2psk_slots(const Code& code);

}  // namespace occ
