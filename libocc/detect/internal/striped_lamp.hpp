// SPDX-License-Identifier: Apache-2.0
// Internal: measures one bright body that may be a striped lamp: is there a blink in it, at which
// frequency, and where is the lamp's centre?
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_centre.hpp"
#include "libocc/detect/internal/stripe_signal.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

struct LampLimits {
  double lit = 0;                    ///< linear signal that stands out from the noise
  double clipped = 0;                ///< linear signal of saturated pixels
  double max_cycles_per_line = 0.5;  ///< highest frequency looked for
};

/// How to read around some lamps.
struct Surroundings {
  const LinearImage& image;
  bool columns;
  double background_dn;
  const std::vector<StripedShape>& found;  ///< lamps that are known already: read as dark

  LineWindow window(const LineBox& box, int stride) const;
};

/// Where to look for a lamp.
struct BodyPlace {
  LineBox body;
  LineBox territory;  ///< may hold the body's glow, and no other body
};

struct StripedLamp {
  Blink blink;  ///< cycles_per_line 0: unreadable
  StripedShape shape;
  double signal = 0;    ///< sum of the linear signal of the lit pixels
  double lit_px = 0;    ///< their number
  double evidence = 0;  ///< log of the likelihood ratio of stripes against none
};

/// The body's coarse blink in a window around it whose bright pixels reach `peak`; cycles_per_line
/// is 0 when there is none to be seen.
Blink coarse_blink(const LineWindow& window, double peak, const BodyPlace& place,
                   const LampLimits& limits);

/// Empty for a body without stripes: fewer than two periods in view, no significant line, a line
/// too weak, or one that differs from side to side. A disc with dark gaps is a lamp even when its
/// frequency cannot be read; cycles_per_line is 0 then.
std::optional<StripedLamp> measure_striped_lamp(const Surroundings& around, const BodyPlace& place,
                                                const Blink& coarse, const LampLimits& limits);

}  // namespace occ::internal::detect
