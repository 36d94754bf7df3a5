// SPDX-License-Identifier: Apache-2.0
// Internal: where the lit lines of a striped lamp begin and end.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

/// The lit part of one line.
struct Chord {
  int line;
  double pos0, pos1;  ///< where the signal crosses a fraction of the line's plateau
  double softness;    ///< distance from 1/4 to 3/4 of the plateau, both ends' mean, over half chord
};

/// Chords of all well-lit lines of a part of a window (stride 1), by line, at a fraction of each
/// line's plateau; `peak`: signal that the bright lines reach.
std::vector<Chord> lit_chords(const LineWindow& window, const LineBox& part, double peak,
                              double fraction);

/// Of a list that is not empty.
double median_softness(const std::vector<Chord>& chords);

/// Most lines between two successive chords.
int widest_gap(const std::vector<Chord>& chords);

}  // namespace occ::internal::detect
