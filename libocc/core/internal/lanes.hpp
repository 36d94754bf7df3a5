// SPDX-License-Identifier: Apache-2.0
// Several numbers at once, as many as a register holds, for bodies of LIBOCC_MULTIVERSION. Masks
// are 0 or -1 in each lane; `mask ? a : b` selects. Registers of 512 bits are not used: they have
// no such masks, and GCC goes through their numbers one by one.
#pragma once

#include <cstring>

#include "libocc/core/internal/multiversion.hpp"

// How a call passes lanes depends on the instruction set; there is none, all is inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace occ::internal::core {

constexpr int max_lanes = 8;

template <Simd>
struct LanesOf {
  typedef float Type __attribute__((vector_size(16)));
};
template <>
struct LanesOf<Simd::avx2> {
  typedef float Type __attribute__((vector_size(32)));
};
template <>
struct LanesOf<Simd::avx512> : LanesOf<Simd::avx2> {};

template <class Lanes>
constexpr int lane_count = sizeof(Lanes) / sizeof(float);

/// Masks and integers of as many lanes.
template <class Lanes>
using LaneInts = decltype(Lanes{} < Lanes{});

template <class Lanes, class Number>
LIBOCC_INLINE Lanes lanes_at(const Number* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}

template <class Lanes, class Number>
LIBOCC_INLINE void store_lanes(const Lanes& lanes, Number* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}

template <class Lanes>
LIBOCC_INLINE Lanes absolute(const Lanes& x) {
  return x < 0 ? -x : x;
}

/// 1 / sqrt(x) to rounding, of 1e-30 for what is less: numbers that are not normal take long. Three
/// steps of Newton's method after the guess by halving the exponent.
template <class Lanes>
LIBOCC_INLINE Lanes inverse_root(const Lanes& x) {
  const Lanes least = Lanes{} + 1e-30F, of = x > least ? x : least;
  LaneInts<Lanes> bits;
  std::memcpy(&bits, &of, sizeof bits);
  bits = 0x5f375a86 - (bits >> 1);
  Lanes y;
  std::memcpy(&y, &bits, sizeof y);
  for (int i = 0; i < 3; ++i) y = y * (1.5F - 0.5F * of * y * y);
  return y;
}

/// Of what is not negative; 0 for the rest.
template <class Lanes>
LIBOCC_INLINE Lanes root(const Lanes& x) {
  return x > 0 ? x * inverse_root(x) : Lanes{};
}

/// Within 5 % of the cube root of x > 0, by a third of the exponent.
template <class Lanes>
LIBOCC_INLINE Lanes rough_cube_root(const Lanes& x) {
  LaneInts<Lanes> bits;
  std::memcpy(&bits, &x, sizeof bits);
  // Converted to numbers and back: integers are not divided in lanes.
  bits =
      __builtin_convertvector(__builtin_convertvector(bits, Lanes) * (1.0F / 3), LaneInts<Lanes>) +
      0x2a5137a0;
  Lanes third;
  std::memcpy(&third, &bits, sizeof third);
  return third;
}

/// Three coordinates.
template <class Lanes>
struct LaneVector {
  Lanes x, y, z;
};

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> operator+(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> operator-(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> operator*(const Lanes& s, const LaneVector<Lanes>& a) {
  return {s * a.x, s * a.y, s * a.z};
}

/// The same vector in every lane, times the lanes' factors.
template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> scaled(const Lanes& s, const float* a) {
  return {s * a[0], s * a[1], s * a[2]};
}

template <class Lanes>
LIBOCC_INLINE Lanes dot(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class Lanes>
LIBOCC_INLINE Lanes dot(const LaneVector<Lanes>& a, const float* b) {
  return a.x * b[0] + a.y * b[1] + a.z * b[2];
}

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> cross(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> cross(const LaneVector<Lanes>& a, const float* b) {
  return {a.y * b[2] - a.z * b[1], a.z * b[0] - a.x * b[2], a.x * b[1] - a.y * b[0]};
}

}  // namespace occ::internal::core
