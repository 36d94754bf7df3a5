// SPDX-License-Identifier: Apache-2.0
// Colour-shift keying by channel: a lamp of a red, a green and a blue emitter says two bits with
// one of four colours of the same power: red (00), green (01), blue (10), a third of each (11). A
// packet begins dark, which no symbol is, then red, green, blue: from these the decoder learns what
// each of the sensor's channels gets of each emitter (crosstalk), whatever the filters are.
#pragma once

#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

LIBOCC_API SlotCode csk_slots(const Code& code);

}  // namespace occ
