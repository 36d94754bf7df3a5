// SPDX-License-Identifier: Apache-2.0
// Internal: which bright stripes belong together.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

/// Whether two boxes lie one behind the other, as stripes of one lamp do: the middle of the shorter
/// within the longer, and a gap of at most half the longer (a lamp shows two periods or more, and
/// its dark phase is a part of one).
bool stacked(const LineBox& a, const LineBox& b);

/// Boxes of the bright bodies in a window: pixels above `level`, connected to stripes, stripes put
/// together over gaps that fit one lamp. Two lamps one behind the other are told apart by a gap
/// that breaks the rhythm or by a waist.
std::vector<LineBox> find_bodies(const LineWindow& window, double level);

}  // namespace occ::internal::detect
