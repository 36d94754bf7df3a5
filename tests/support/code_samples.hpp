// SPDX-License-Identifier: Apache-2.0
// Samples of a waveform as a rolling shutter takes them, for the tests of codes.
#pragma once

#include <cmath>
#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/core/random.hpp"

namespace occ::test {

/// Mean light over [start_s, start_s + exposure_s] of a waveform that begins at time 0. Computed in
/// fine steps, independently of the closed form in the library.
inline double mean_light(const Waveform& wave, std::size_t channel, double start_s,
                         double exposure_s) {
  constexpr int parts = 32;
  const std::vector<double>& chips = wave.chips[channel];
  double sum = 0;
  for (int i = 0; i < parts; ++i) {
    const double at = (start_s + exposure_s * (i + 0.5) / parts) * wave.chip_rate_hz;
    const double n = static_cast<double>(chips.size());
    sum += chips[static_cast<std::size_t>(at - n * std::floor(at / n))];
  }
  return sum / parts;
}

struct Shutter {
  int frames = 40;
  int rows = 60;
  double row_time_s = 2e-5;
  double exposure_s = 2e-5;
  double frame_rate_hz = 30;
  double begin_s = 0;      ///< start of the first frame within a period
  double clock_error = 0;  ///< relative error of the lamp's clock
  double sigma = 0;        ///< noise of a sample
  double stated_sigma = 0.02;
  int other_row_shift = 90;  ///< distance of further lamps in rows

  std::vector<LightSample> of(const Waveform& wave, std::uint64_t seed = 1,
                              bool colours = false) const {
    Random random(seed);
    std::vector<LightSample> samples;
    for (int f = 0; f < frames; ++f)
      for (std::size_t c = 0; c < wave.chips.size(); ++c)
        for (int r = 0; r < rows; ++r) {
          const int shift = colours ? 0 : static_cast<int>(c) * other_row_shift;
          const double start = f / frame_rate_hz + (r + shift) * row_time_s;
          const double light =
              mean_light(wave, c, (start + begin_s) * (1 + clock_error), exposure_s);
          samples.push_back({start, exposure_s, light + sigma * random.normal(),
                             std::max(sigma, stated_sigma), static_cast<int>(c), f});
        }
    return samples;
  }
};

}  // namespace occ::test
