// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/digitiser.hpp"

#include <algorithm>
#include <cmath>

namespace occ {

Digitiser::Digitiser(const Sensor& sensor)
    : levels_(static_cast<int>(sensor.full_scale_dn()) + 1),
      gain_(sensor.gain_dn_per_e),
      black_(sensor.black_level_dn) {
  if (sensor.response == Response::linear) return;
  bounds_e_.resize(static_cast<std::size_t>(levels_ - 1));
  for (int level = 0; level < levels_ - 1; ++level)
    bounds_e_[static_cast<std::size_t>(level)] = sensor.linear_dn(level + 0.5) / gain_;
}

double Digitiser::upper_bound_e(int level) const {
  return bounds_e_.empty() ? (level + 0.5 - black_) / gain_
                           : bounds_e_[static_cast<std::size_t>(level)];
}

int Digitiser::grey_level(double electrons) const {
  if (bounds_e_.empty())
    return static_cast<int>(std::clamp(black_ + gain_ * electrons + 0.5, 0.0, levels_ - 0.5));
  const auto bound = std::upper_bound(bounds_e_.begin(), bounds_e_.end(), electrons);
  return static_cast<int>(bound - bounds_e_.begin());
}

}  // namespace occ
