// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/exposure.hpp"

#include <algorithm>
#include <cmath>

namespace occ {

double lit_fraction(const Lamp& lamp, double start_s, double exposure_s) {
  if (!lamp.frequency_hz) return 1;
  // Lit time since the beginning of the period in which the exposure starts, in periods.
  const auto lit_until = [&](double periods) {
    const double whole = std::floor(periods);
    return whole * lamp.duty + std::min(periods - whole, lamp.duty);
  };
  const double first = start_s * *lamp.frequency_hz;
  const double begin = first - std::floor(first);
  const double length = exposure_s * *lamp.frequency_hz;
  return std::clamp((lit_until(begin + length) - lit_until(begin)) / length, 0.0, 1.0);
}

std::vector<double> lit_fractions(const Lamp& lamp, const Sensor& sensor, double start_s,
                                  int lines) {
  std::vector<double> fractions(static_cast<std::size_t>(lines));
  for (int i = 0; i < lines; ++i)
    fractions[static_cast<std::size_t>(i)] =
        lit_fraction(lamp, start_s + i * sensor.row_time_s, sensor.exposure_s);
  return fractions;
}

}  // namespace occ
