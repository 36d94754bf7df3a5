// SPDX-License-Identifier: Apache-2.0
// Grey levels of pixels that all have the same mean, drawn fast. Their distribution is known, so a
// number of 16 random bits is compared with the distribution's steps. A number in whose cell the
// distribution steps is refined by 53 more bits, so the tails are right as well.
#pragma once

#include <cstdint>
#include <vector>

#include "libocc/simulate/internal/digitiser.hpp"
#include "libocc/simulate/internal/noise_key.hpp"

namespace occ::internal::simulate {

class DarkNoise {
 public:
  /// Of pixels with this many mean electrons, dark current included.
  DarkNoise(const Sensor& sensor, const Digitiser& digitiser, double mean_e);

  /// False when there are so many levels that each had better be drawn by itself.
  bool tabulated() const { return !cumulative_.empty(); }

  /// Grey levels of the pixels first, first + 1, ... (counted row by row); up to `spare` more are
  /// written.
  static constexpr int spare = 32;
  static constexpr std::uint32_t pixels_a_block = 8;  ///< two to a word
  void draw(Simd simd, const NoiseKey& key, RandomWords random, std::uint32_t first, int count,
            std::uint16_t* levels) const;

 private:
  static constexpr int most = 2048;  // pixels at a time
  void draw_batch(Simd simd, const NoiseKey& key, const RandomWords& random, std::uint32_t first,
                  int count, std::uint16_t* levels) const;
  int refined(const NoiseKey& key, std::uint32_t pixel, std::uint32_t number) const;

  int first_level_ = 0;                // of those that occur
  std::vector<double> cumulative_;     // of first_level_, first_level_ + 1, ...
  std::vector<std::uint16_t> steps_;   // numbers in whose cell the distribution steps
  std::vector<std::uint16_t> levels_;  // by number, instead of comparing with many steps
};

}  // namespace occ::internal::simulate
