// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: Philox-4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random
// numbers: as easy as 1, 2, 3", SC 2011). A number is a function of (key, counter), so an image
// does not depend on the number of threads or the order in which its pixels are drawn.
#pragma once

#include <array>
#include <cstdint>

#include "libocc/core/abi.hpp"

namespace occ {

/// The 128 random bits of one counter and one key.
LIBOCC_API std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                               std::array<std::uint32_t, 2> key);

/// A stream keyed by (seed, stream): sequential draws for tests, Monte Carlo and samplers.
class LIBOCC_API Random {
 public:
  /// Equal arguments give equal numbers; streams of one seed are independent of one another.
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint32_t bits();                     ///< 32 random bits
  double uniform();                         ///< in [0, 1), 53 bits
  double uniform(double low, double high);  ///< in [low, high)
  double normal();                          ///< mean 0, variance 1 (Box-Muller)
  int poisson(double mean);  ///< 0 <= mean <= 2e9; exact, in a time independent of the mean
  int below(int count);      ///< in {0, ..., count-1}, count > 0

 private:
  std::array<std::uint32_t, 4> counter_{};
  std::array<std::uint32_t, 2> key_{};
  std::array<std::uint32_t, 4> block_{};
  int used_ = 4;
  double spare_normal_ = 0;
  bool has_spare_ = false;
};

}  // namespace occ
