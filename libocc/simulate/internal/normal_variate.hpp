// SPDX-License-Identifier: Apache-2.0
// Converts 32 random bits to a normal variable z by the inverse of its distribution. All operations
// give the same bits on every instruction set and can be vectorised.
//
// One bit is the sign; 31 bits give the tail probability t/2, 0 < t <= 1. With x = 1 - t and
// s^2 = -ln(1 - x^2), z / x is a smooth function of s. It is approximated by a rational function,
// fitted to 6e-7. 1 - x^2 = t (2 - t) is computed without cancellation, so |z| reaches 6.3.
#pragma once

#include <cstdint>
#include <cstring>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::simulate {

/// No normal_variate() is farther from 0.
constexpr double max_normal_variate = 6.4;

/// ln(v) for 0 < v <= 1, with an error of 1e-7 times the larger of 1 and |ln(v)|.
LIBOCC_INLINE float natural_logarithm(float v) {
  constexpr std::int32_t two_thirds = 0x3f2aaaab;  // bits of 2/3 as a float
  std::int32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  const std::int32_t exponent = (bits - two_thirds) >> 23;
  const std::int32_t rest = bits - exponent * (1 << 23);
  float mantissa;  // in [2/3, 4/3)
  std::memcpy(&mantissa, &rest, sizeof mantissa);
  const float u = mantissa - 1;
  const float u2 = u * u;  // least-squares fit, summed in pairs for parallel execution
  const float p01 = 0.999999453f - 0.499998934f * u, p23 = 0.333404539f - 0.250098265f * u;
  const float p45 = 0.197556447f - 0.163892805f * u, p67 = 0.172894018f - 0.154939305f * u;
  const float p = (p01 + p23 * u2) + (p45 + p67 * u2) * (u2 * u2);
  return static_cast<float>(exponent) * 0.693147181f + p * u;
}

/// A normal variable of mean 0 and variance 1.
LIBOCC_INLINE float normal_variate(std::uint32_t bits) {
  const auto magnitude = static_cast<std::int32_t>(bits & 0x7fffffffu);
  const float t = static_cast<float>(magnitude) * 0x1p-31f + 0x1p-32f;
  const float x = 1 - t;
  const float s = __builtin_sqrtf(-natural_logarithm(t * (2 - t)));
  const float s2 = s * s;
  const float p01 = 1.2533149f - 0.727125794f * s, p23 = 0.598080734f - 0.203355348f * s;
  const float p45 = 0.0883057584f - 0.0153047687f * s;
  const float p = (p01 + p23 * s2) + (p45 + 0.00441799926f * s2) * (s2 * s2);
  const float q01 = 1 - 0.580123257f * s, q23 = 0.214970069f - 0.00852618611f * s;
  const float q45 = 0.00278037524f * s - 0.00293106858f;
  const float q = (q01 + q23 * s2) + q45 * (s2 * s2);
  const float z = x * (p / q);
  return static_cast<std::int32_t>(bits) < 0 ? -z : z;
}

}  // namespace occ::internal::simulate
