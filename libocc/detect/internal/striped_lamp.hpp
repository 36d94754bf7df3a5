// SPDX-License-Identifier: Apache-2.0
// Internal: decides whether a bright region is a striped lamp, and measures its blink frequency and
// its centre.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_shape.hpp"
#include "libocc/detect/internal/stripe_signal.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

struct LampLimits {
  double lit = 0;                    ///< detection threshold [linear signal]
  double clipped = 0;                ///< linear signal of saturated pixels
  double max_cycles_per_line = 0.5;  ///< highest frequency searched
};

/// Image and background around some lamp candidates.
struct LampContext {
  const LinearImage& image;
  bool columns;
  double background_dn;
  const std::vector<StripedShape>& found;  ///< lamps already measured; their pixels are read as 0

  LineWindow window(const LineBox& box, int stride) const;
};

/// Lamp candidate.
struct LampRegion {
  LineBox core;    ///< its bright pixels
  LineBox extent;  ///< may contain the light around the core, and no other candidate
};

struct StripedLamp {
  Blink blink;  ///< cycles_per_line is 0 when the frequency could not be measured
  StripedShape shape;
  double signal = 0;    ///< sum of the linear signal of the lit pixels
  double lit_px = 0;    ///< number of lit pixels
  double evidence = 0;  ///< log likelihood ratio of stripes against no stripes
};

/// Estimates the blink of a candidate coarsely, in a window around it whose bright pixels reach
/// `peak`; cycles_per_line is 0 when no blink is visible.
Blink coarse_blink(const LineWindow& window, double peak, const LampRegion& region,
                   const LampLimits& limits);

/// Empty for a candidate without stripes: fewer than two periods in view, no significant frequency,
/// too small an amplitude, or an amplitude that differs between the two halves of the lines. A disc
/// with dark gaps is a lamp even when its frequency cannot be measured; cycles_per_line is 0 then.
std::optional<StripedLamp> measure_striped_lamp(const LampContext& context,
                                                const LampRegion& region, const Blink& coarse,
                                                const LampLimits& limits);

}  // namespace occ::internal::detect
