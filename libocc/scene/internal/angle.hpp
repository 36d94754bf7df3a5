// SPDX-License-Identifier: Apache-2.0
// Angles are radians in the library and degrees in files. Degrees carry more digits than a double,
// so that every angle in radians has a text in degrees that reads back to it. Pi is the double
// nearest to it, as in everybody's `degrees * pi / 180`.
#pragma once

#include "libocc/core/math.hpp"

namespace occ::internal::scene {

constexpr long double radians_per_degree = static_cast<long double>(pi) / 180;

inline double radians(long double degrees) {
  return static_cast<double>(degrees * radians_per_degree);
}

}  // namespace occ::internal::scene
