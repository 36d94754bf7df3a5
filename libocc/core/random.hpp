// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: Philox-4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random
// numbers: as easy as 1, 2, 3", SC 2011). A number is a function of (key, counter), so an image
// does not depend on the order or the number of threads in which its pixels were drawn.
#pragma once

#include <array>
#include <cstdint>

#include "libocc/core/abi.hpp"

namespace occ {

/// The 128 random bits that belong to one counter under one key.
LIBOCC_API std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                               std::array<std::uint32_t, 2> key);

/// A stream keyed by (seed, stream): sequential draws for tests, Monte Carlo and samplers.
class LIBOCC_API Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint32_t bits();                     ///< 32 random bits
  double uniform();                         ///< in [0, 1), 53 bits
  double uniform(double low, double high);  ///< in [low, high)
  double normal();                          ///< mean 0, variance 1 (Box-Muller)
  int poisson(double mean);  ///< 0 <= mean <= 2e9; exact, at a cost that does not grow with it
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
