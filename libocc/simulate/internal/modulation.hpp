// SPDX-License-Identifier: Apache-2.0
// What a blinking lamp gives to pixels that are exposed for a finite time.
#pragma once

#include <vector>

#include "libocc/simulate/internal/frame.hpp"

namespace occ::internal::simulate {

/// Mean of the lamp's light over [start_s, start_s + exposure_s] in parts of power_w: its waveform,
/// or lit for the first `duty` of every period; `phase` periods have passed at t = 0. 1 for a lamp
/// that does not blink.
double lit_fraction(const Lamp& lamp, double start_s, double exposure_s);

/// When within a stretch of time a lamp's light falls: mean level in parts of power_w, mean time
/// from the stretch's beginning and its standard deviation.
struct LightMoments {
  double mean = 1, mean_time_s = 0, sigma_s = 0;
};

/// Of a lamp that blinks, or shines at its mean level throughout when the plan leaves that out.
LightMoments seen_light(const Lamp& lamp, bool blinks, double begin_s, double length_s);

/// The lit fraction for `count` lines (rows or columns, whichever the sensor reads out) from
/// `first` on; 1 for a lamp whose image contains its blinking already (internal/motion.hpp).
std::vector<double> lit_fractions(const Lamp& lamp, const Frame& frame, int first, int count);

}  // namespace occ::internal::simulate
