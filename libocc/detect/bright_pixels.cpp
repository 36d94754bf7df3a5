// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/bright_pixels.hpp"

#include <algorithm>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace occ::internal::detect {
namespace {

constexpr int block = 64;

template <typename T>
bool any_above(const T* values, int count, T limit) {
  T highest = 0;
  for (int i = 0; i < count; ++i) highest = std::max(highest, values[i]);
  return highest > limit;
}

template <typename T>
int first_block_plain(const T* values, int from, int count, T limit) {
  for (; from < count; from += block)
    if (any_above(values + from, std::min(block, count - from), limit)) return from;
  return count;
}

#if defined(__x86_64__)

// Unsigned a > b if and only if the saturating difference a - b is not zero, for bytes and words.
template <typename T>
__attribute__((target("avx2"))) int first_block_avx2(const T* values, int from, int count,
                                                     T limit) {
  const __m256i limits = sizeof(T) == 1 ? _mm256_set1_epi8(static_cast<char>(limit))
                                        : _mm256_set1_epi16(static_cast<short>(limit));
  constexpr int step = 32 / static_cast<int>(sizeof(T));
  const auto load = [values](int at) __attribute__((target("avx2"))) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(values + at));
  };
  constexpr int ahead = 2048 / static_cast<int>(sizeof(T));
  // Dark stretches are skipped by four blocks at a time, with one test for all of them.
  for (; from + 4 * block <= count; from += 4 * block) {
    for (int i = 0; i < 4 * block; i += 2 * step)
      _mm_prefetch(reinterpret_cast<const char*>(values + from + i + ahead), _MM_HINT_T0);
    __m256i highest = load(from);
    for (int i = step; i < 4 * block; i += step) {
      highest = sizeof(T) == 1 ? _mm256_max_epu8(highest, load(from + i))
                               : _mm256_max_epu16(highest, load(from + i));
    }
    const __m256i above =
        sizeof(T) == 1 ? _mm256_subs_epu8(highest, limits) : _mm256_subs_epu16(highest, limits);
    if (!_mm256_testz_si256(above, above)) break;
  }
  for (; from + block <= count; from += block) {
    __m256i above = _mm256_setzero_si256();
    for (int i = 0; i < block; i += step) {
      const __m256i v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(values + from + i));
      above = _mm256_or_si256(
          above, sizeof(T) == 1 ? _mm256_subs_epu8(v, limits) : _mm256_subs_epu16(v, limits));
    }
    if (!_mm256_testz_si256(above, above)) return from;
  }
  return first_block_plain(values, from, count, limit);
}

template <typename T>
int first_block_sse2(const T* values, int from, int count, T limit) {
  const __m128i limits = sizeof(T) == 1 ? _mm_set1_epi8(static_cast<char>(limit))
                                        : _mm_set1_epi16(static_cast<short>(limit));
  constexpr int step = 16 / static_cast<int>(sizeof(T));
  for (; from + block <= count; from += block) {
    __m128i above = _mm_setzero_si128();
    for (int i = 0; i < block; i += step) {
      const __m128i v = _mm_loadu_si128(reinterpret_cast<const __m128i*>(values + from + i));
      above = _mm_or_si128(above,
                           sizeof(T) == 1 ? _mm_subs_epu8(v, limits) : _mm_subs_epu16(v, limits));
    }
    if (_mm_movemask_epi8(_mm_cmpeq_epi8(above, _mm_setzero_si128())) != 0xffff) return from;
  }
  return first_block_plain(values, from, count, limit);
}

template <typename T>
int first_block(const T* values, int from, int count, T limit) {
  static const bool avx2 = __builtin_cpu_supports("avx2");
  return avx2 ? first_block_avx2(values, from, count, limit)
              : first_block_sse2(values, from, count, limit);
}

#else

template <typename T>
int first_block(const T* values, int from, int count, T limit) {
  return first_block_plain(values, from, count, limit);
}

#endif

}  // namespace

int first_block_above(const std::uint8_t* values, int from, int count, std::uint8_t limit) {
  return first_block(values, from, count, limit);
}

int first_block_above(const std::uint16_t* values, int from, int count, std::uint16_t limit) {
  return first_block(values, from, count, limit);
}

std::uint64_t bits_above(const std::uint8_t* values, std::uint8_t limit) {
  std::uint64_t bits = 0;
#if defined(__x86_64__)
  const __m128i limits = _mm_set1_epi8(static_cast<char>(limit));
  for (int i = 0; i < block; i += 16) {
    const __m128i v = _mm_loadu_si128(reinterpret_cast<const __m128i*>(values + i));
    const __m128i not_above = _mm_cmpeq_epi8(_mm_subs_epu8(v, limits), _mm_setzero_si128());
    bits |= static_cast<std::uint64_t>(~_mm_movemask_epi8(not_above) & 0xffff) << i;
  }
#else
  for (int i = 0; i < block; ++i) bits |= static_cast<std::uint64_t>(values[i] > limit) << i;
#endif
  return bits;
}

}  // namespace occ::internal::detect
