// SPDX-License-Identifier: Apache-2.0
// Draws the noise of pixels: Poisson photoelectrons, clipped by the full well, and Gaussian read
// noise.
//
// DarkNoise draws grey levels of pixels that all have the same mean. A number of 16 random bits is
// compared with the cumulative distribution. If the distribution has a step within the cell of the
// number, 53 more bits refine it, so that the tails are exact as well.
//
// LitNoise draws electrons of pixels with different means. With read noise of one electron or more,
// the sum of photoelectrons and read noise has a smooth distribution: the discreteness of electrons
// is damped to exp(-2 pi^2). The sum is drawn from a normal variable z by its first four cumulants
// (Cornish and Fisher, "Moments and cumulants in the specification of distributions", 1938). With
// standard deviation s, skewness g and excess kurtosis k it is
//     s (z + g (z^2 - 1)/6 + k (z^3 - 3 z)/24 - g^2 (2 z^3 - 5 z)/36).
// The error in probability is below 2e-5 for g < 0.1 (measured). Other pixels are drawn exactly:
// pixels of a sensor with less read noise, pixels with few photoelectrons, and pixels near the full
// well.
#pragma once

#include <cstdint>
#include <vector>

#include "libocc/radiometry/sensor.hpp"
#include "libocc/simulate/internal/digitiser.hpp"
#include "libocc/simulate/internal/noise_key.hpp"

namespace occ::internal::simulate {

class DarkNoise {
 public:
  /// Noise of pixels with `mean_e` mean electrons, dark current included.
  DarkNoise(const Sensor& sensor, const Digitiser& digitiser, double mean_e);

  /// False if there are too many levels for a table; use LitNoise then.
  bool tabulated() const { return !cumulative_.empty(); }

  /// Draws the grey levels of the pixels first, first + 1, ... (counted row by row). Up to
  /// `padding` more are written.
  static constexpr int padding = 32;
  static constexpr std::uint32_t pixels_per_block = 8;  ///< two per random word
  void draw(Simd simd, const NoiseKey& key, RandomWords random, std::uint32_t first, int count,
            std::uint16_t* levels) const;

 private:
  static constexpr int max_batch = 2048;  // pixels at a time; their buffers are on the stack
  void draw_batch(Simd simd, const NoiseKey& key, const RandomWords& random, std::uint32_t first,
                  int count, std::uint16_t* levels) const;
  int refined(const NoiseKey& key, std::uint32_t pixel, std::uint32_t number) const;

  int first_level_ = 0;               // lowest level that occurs
  std::vector<double> cumulative_;    // probability up to first_level_, first_level_ + 1, ...
  std::vector<std::uint16_t> steps_;  // numbers whose cell contains a step of the distribution
  std::vector<std::uint16_t>
      levels_;  // level of each number; faster than comparing with many steps
};

class LitNoise {
 public:
  explicit LitNoise(const Sensor& sensor);

  /// Draws the electrons of the pixels first, first + 1, ... from their means, dark current
  /// included. Up to one batch more is read and written.
  static constexpr int batch = 16;
  static constexpr std::uint32_t pixels_per_block = 4;
  void draw(Simd simd, const NoiseKey& key, const RandomWords& random, std::uint32_t first,
            int count, const float* mean_e, float* electrons) const;

  /// Interval of mean electrons in which pixels are drawn exactly.
  struct Range {
    float low = 0, high = 0;
    bool contains(float mean) const { return mean > low && mean < high; }
  };

 private:
  double exact(const NoiseKey& key, std::uint32_t pixel, double mean_e) const;

  double full_well_e_, read_noise_e_;
  Range skewed_, near_full_;
};

}  // namespace occ::internal::simulate
