// SPDX-License-Identifier: Apache-2.0
// Electrons that lit pixels give: Poisson photoelectrons, clipped by the full well, and Gaussian
// read noise.
//
// Read noise of an electron or more leaves no trace of electrons being whole (exp(-2 pi^2) of it),
// so their sum has a smooth distribution, drawn from a normal variable z by its first four
// cumulants (Cornish and Fisher, "Moments and cumulants in the specification of distributions",
// 1938): with deviation s, skewness g and excess kurtosis k
//     s (z + g (z^2 - 1)/6 + k (z^3 - 3 z)/24 - g^2 (2 z^3 - 5 z)/36).
// That holds to 2e-5 of probability while g < 0.1 (measured). Other pixels are drawn as nature
// does it: those of a quieter sensor, of few photoelectrons, and those near the full well.
#pragma once

#include "libocc/radiometry/sensor.hpp"
#include "libocc/simulate/internal/noise_key.hpp"

namespace occ::internal::simulate {

class LitNoise {
 public:
  explicit LitNoise(const Sensor& sensor);

  /// Of the pixels first, first + 1, ... with this many mean electrons, dark current included. Up
  /// to a batch more is read and written.
  static constexpr int batch = 16;
  static constexpr std::uint32_t pixels_a_block = 4;
  void draw(Simd simd, const NoiseKey& key, const RandomWords& random, std::uint32_t first,
            int count, const float* mean_e, float* electrons) const;

  /// Mean electrons between which pixels are drawn exactly.
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
