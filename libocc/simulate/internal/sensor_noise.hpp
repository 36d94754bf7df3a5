// SPDX-License-Identifier: Apache-2.0
// Draws grey levels of pixels. Every random number is a function of (seed, frame, pixel), so a
// pixel's noise does not depend on its neighbours, on the lamps elsewhere, or on the order of work.
//
// A lit pixel is drawn as nature does it: Poisson electrons, full well, Gaussian read noise,
// response, rounding. Dark pixels all have the same distribution of grey levels; its inverse,
// tabulated for 16-bit numbers, gives one grey level per table look-up. A number in whose cell the
// distribution steps is refined by 53 more bits, so the tails are right as well.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "libocc/simulate/internal/digitiser.hpp"

namespace occ {

class SensorNoise {
 public:
  SensorNoise(const Sensor& sensor, const Digitiser& digitiser, std::uint64_t seed,
              std::uint32_t frame);

  static constexpr std::uint32_t dark_block = 8;  ///< dark pixels that share one Philox block

  /// Grey levels of the dark pixels dark_block * block ... + dark_block - 1 (counted row by row).
  std::array<int, dark_block> dark(std::uint32_t block) const;

  /// Grey level of one pixel with this many mean electrons, dark current included.
  int lit(std::uint32_t pixel, double mean_e) const;

 private:
  void tabulate_dark();
  double probability_below(double electrons) const;
  int refine(std::uint32_t pixel, std::uint32_t number) const;

  const Digitiser& digitiser_;
  double full_well_e_, read_noise_e_, dark_e_;
  std::uint64_t seed_;
  std::uint32_t frame_;
  int first_level_ = 0;                    // of the tabulated ones
  std::vector<double> cumulative_;         // of first_level_, first_level_ + 1, ...
  std::vector<std::uint16_t> dark_table_;  // level - first_level_, or `refine`; empty: draw as lit
};

}  // namespace occ
