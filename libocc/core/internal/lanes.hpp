// SPDX-License-Identifier: Apache-2.0
// SIMD vectors of one register, for bodies of LIBOCC_MULTIVERSION. Masks are 0 or -1 in each lane;
// `mask ? a : b` selects. Registers of 512 bits are not used: they have no such masks, and GCC
// processes their elements one by one.
#pragma once

#include <cstring>

#include "libocc/core/internal/multiversion.hpp"

// The calling convention of vectors depends on the instruction set; all functions are inlined.
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

/// Masks and integers with the same number of lanes.
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

/// 1 / sqrt(x) to rounding; x is at least 1e-30, because denormal numbers are slow. Three Newton
/// steps from an estimate with half the exponent.
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

/// sqrt(x) for x >= 0, otherwise 0.
template <class Lanes>
LIBOCC_INLINE Lanes root(const Lanes& x) {
  return x > 0 ? x * inverse_root(x) : Lanes{};
}

/// Cube root of x > 0 to 5 %, from a third of the exponent.
template <class Lanes>
LIBOCC_INLINE Lanes rough_cube_root(const Lanes& x) {
  LaneInts<Lanes> bits;
  std::memcpy(&bits, &x, sizeof bits);
  // Converted to float and back, because integers have no vector division.
  bits =
      __builtin_convertvector(__builtin_convertvector(bits, Lanes) * (1.0F / 3), LaneInts<Lanes>) +
      0x2a5137a0;
  Lanes third;
  std::memcpy(&third, &bits, sizeof third);
  return third;
}

/// 3-vectors, one in each lane.
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

/// One vector times the factor of each lane.
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
