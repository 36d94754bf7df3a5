// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/philox_blocks.hpp"

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/core/random.hpp"

namespace occ::internal::core {
namespace {

struct Job {
  const std::uint32_t* first;
  std::uint32_t count;
  std::array<std::uint32_t, 3> c;
  std::array<std::uint32_t, 2> key;
};

// A vector of 64-bit lanes, each with one 32-bit word of a block in its low half; what is in the
// high half does not matter to multiply().
template <Simd simd>
struct Lanes;

#if defined(__x86_64__)

template <>
struct Lanes<Simd::baseline> {
  using Vector = __m128i;
  static constexpr std::uint32_t size = 2;
  static LIBOCC_INLINE Vector all(std::uint64_t v) {
    return _mm_set1_epi64x(static_cast<std::int64_t>(v));
  }
  static LIBOCC_INLINE Vector load(const std::uint32_t* from) {
    return _mm_unpacklo_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from)),
                              _mm_setzero_si128());
  }
  static LIBOCC_INLINE Vector multiply(Vector a, Vector b) { return _mm_mul_epu32(a, b); }
  static LIBOCC_INLINE Vector mix(Vector product, Vector b, Vector c) {
    return _mm_xor_si128(_mm_xor_si128(_mm_srli_epi64(product, 32), b), c);
  }
  static LIBOCC_INLINE Vector pair(Vector low, Vector high) {
    return _mm_or_si128(_mm_and_si128(low, all(0xffffffffu)), _mm_slli_epi64(high, 32));
  }
  static LIBOCC_INLINE void store(Vector first, Vector second, std::uint32_t* to) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm_unpacklo_epi64(first, second));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 4), _mm_unpackhi_epi64(first, second));
  }
};

template <>
struct Lanes<Simd::avx2> {
  using Vector = __m256i;
  static constexpr std::uint32_t size = 4;
  LIBOCC_AVX2 static LIBOCC_INLINE Vector all(std::uint64_t v) {
    return _mm256_set1_epi64x(static_cast<std::int64_t>(v));
  }
  LIBOCC_AVX2 static LIBOCC_INLINE Vector load(const std::uint32_t* from) {
    return _mm256_cvtepu32_epi64(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
  }
  LIBOCC_AVX2 static LIBOCC_INLINE Vector multiply(Vector a, Vector b) {
    return _mm256_mul_epu32(a, b);
  }
  LIBOCC_AVX2 static LIBOCC_INLINE Vector mix(Vector product, Vector b, Vector c) {
    return _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(product, 32), b), c);
  }
  LIBOCC_AVX2 static LIBOCC_INLINE Vector pair(Vector low, Vector high) {
    return _mm256_blend_epi32(low, _mm256_slli_epi64(high, 32), 0xaa);
  }
  LIBOCC_AVX2 static LIBOCC_INLINE void store(Vector first, Vector second, std::uint32_t* to) {
    const __m256i even = _mm256_unpacklo_epi64(first, second);
    const __m256i odd = _mm256_unpackhi_epi64(first, second);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permute2x128_si256(even, odd, 0x20));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + 8),
                        _mm256_permute2x128_si256(even, odd, 0x31));
  }
};

template <>
struct Lanes<Simd::avx512> {
  using Vector = __m512i;
  static constexpr std::uint32_t size = 8;
  LIBOCC_AVX512 static LIBOCC_INLINE Vector all(std::uint64_t v) {
    return _mm512_set1_epi64(static_cast<std::int64_t>(v));
  }
  LIBOCC_AVX512 static LIBOCC_INLINE Vector load(const std::uint32_t* from) {
    return _mm512_maskz_cvtepu32_epi64(0xff,
                                       _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
  }
  LIBOCC_AVX512 static LIBOCC_INLINE Vector multiply(Vector a, Vector b) {
    // Masked by nothing: GCC 12 warns of its own header otherwise.
    return _mm512_maskz_mul_epu32(0xff, a, b);
  }
  LIBOCC_AVX512 static LIBOCC_INLINE Vector mix(Vector product, Vector b, Vector c) {
    return _mm512_ternarylogic_epi64(_mm512_maskz_srli_epi64(0xff, product, 32), b, c,
                                     0x96);  // a ^ b ^ c
  }
  LIBOCC_AVX512 static LIBOCC_INLINE Vector pair(Vector low, Vector high) {
    return _mm512_mask_blend_epi32(0xaaaa, low, _mm512_maskz_slli_epi64(0xff, high, 32));
  }
  LIBOCC_AVX512 static LIBOCC_INLINE void store(Vector first, Vector second, std::uint32_t* to) {
    const __m512i low = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
    const __m512i high = _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15);
    _mm512_storeu_si512(to, _mm512_permutex2var_epi64(first, low, second));
    _mm512_storeu_si512(to + 16, _mm512_permutex2var_epi64(first, high, second));
  }
};

#define LIBOCC_TARGET
#define LANES Lanes<Simd::baseline>
#include "libocc/core/internal/philox_rounds.inc"
#undef LIBOCC_TARGET
#undef LANES
#define LIBOCC_TARGET LIBOCC_AVX2
#define LANES Lanes<Simd::avx2>
#include "libocc/core/internal/philox_rounds.inc"
#undef LIBOCC_TARGET
#undef LANES
#define LIBOCC_TARGET LIBOCC_AVX512
#define LANES Lanes<Simd::avx512>
#include "libocc/core/internal/philox_rounds.inc"
#undef LIBOCC_TARGET
#undef LANES

void run(Simd simd, const Job& job, std::uint32_t* words) {
  if (simd == Simd::avx512) return blocks(Lanes<Simd::avx512>(), job, words);
  if (simd == Simd::avx2) return blocks(Lanes<Simd::avx2>(), job, words);
  blocks(Lanes<Simd::baseline>(), job, words);
}

#else

void run(Simd, const Job& job, std::uint32_t* words) {
  for (std::uint32_t block = 0; block < job.count; ++block)
    for (const std::uint32_t word :
         philox({job.first[block], job.c[0], job.c[1], job.c[2]}, job.key))
      *words++ = word;
}

#endif

}  // namespace

void philox_blocks(Simd simd, const std::uint32_t* first, std::uint32_t count,
                   const std::array<std::uint32_t, 3>& c, const std::array<std::uint32_t, 2>& key,
                   std::uint32_t* words) {
  run(simd, {first, count, c, key}, words);
}

}  // namespace occ::internal::core
