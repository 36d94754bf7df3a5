// SPDX-License-Identifier: Apache-2.0
// Constants and elementary functions that the standard library of C++17 does not offer.
#pragma once

namespace occ {

inline constexpr double pi = 3.14159265358979323846;

constexpr double square(double value) { return value * value; }

}  // namespace occ
