// SPDX-License-Identifier: Apache-2.0
// Compiles one function for several instruction sets and chooses at run time. The body is an inline
// function template in plain C++, whose loops the compiler vectorises. Its parameter is the
// instruction set:
//
//     template <Simd>
//     LIBOCC_INLINE void scale_body(float* values, int count) { ... }
//     LIBOCC_MULTIVERSION(scale, (float* values, int count), (values, count))
//     scale_for(widest_simd())(values, count);
//
// Bodies must not use Eigen types, whose packets must not depend on the instruction set.
#pragma once

#include "libocc/core/simd.hpp"

#define LIBOCC_INLINE inline __attribute__((always_inline))
#define LIBOCC_LAMBDA_INLINE __attribute__((always_inline))

#if defined(__x86_64__)

#include <immintrin.h>

#define LIBOCC_AVX2 __attribute__((target("avx2")))
#define LIBOCC_AVX512 __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl")))
#define LIBOCC_MULTIVERSION(name, parameters, arguments)                                  \
  LIBOCC_AVX512 void name##_avx512 parameters { name##_body<Simd::avx512> arguments; }    \
  LIBOCC_AVX2 void name##_avx2 parameters { name##_body<Simd::avx2> arguments; }          \
  void name##_baseline parameters { name##_body<Simd::baseline> arguments; }              \
  auto name##_for(Simd simd) {                                                            \
    return simd == Simd::avx512 ? &name##_avx512                                          \
                                : (simd == Simd::avx2 ? &name##_avx2 : &name##_baseline); \
  }

#else

#define LIBOCC_MULTIVERSION(name, parameters, arguments)                     \
  void name##_baseline parameters { name##_body<Simd::baseline> arguments; } \
  auto name##_for(Simd) { return &name##_baseline; }

#endif
