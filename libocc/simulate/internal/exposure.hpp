// SPDX-License-Identifier: Apache-2.0
// What a blinking lamp gives to a pixel that is exposed for a finite time.
#pragma once

#include <vector>

#include "libocc/radiometry/sensor.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ {

/// Mean of the lamp's square wave over [start_s, start_s + exposure_s]: lit for the first `duty` of
/// every period, the first of which begins at t = 0. 1 for a lamp that does not blink.
double lit_fraction(const Lamp& lamp, double start_s, double exposure_s);

/// The same for each line (row or column, whichever the sensor reads out) of `lines`.
std::vector<double> lit_fractions(const Lamp& lamp, const Sensor& sensor, double start_s,
                                  int lines);

}  // namespace occ
