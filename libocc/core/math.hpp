// SPDX-License-Identifier: Apache-2.0
// Constants and elementary functions that the standard library of C++17 does not offer.
#pragma once

#include <limits>

namespace occ {

/// Ratio of a circle's circumference to its diameter.
inline constexpr double pi = 3.14159265358979323846;
/// Positive infinity.
inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// value * value; evaluates its argument once.
constexpr double square(double value) { return value * value; }

}  // namespace occ
