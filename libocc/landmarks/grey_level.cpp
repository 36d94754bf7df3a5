// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/landmarks/internal/saddles.hpp"

namespace occ::internal::landmarks {
namespace {

template <class Pixel, Simd>
LIBOCC_INLINE void add_pixels_body(const Pixel* pixels, int count, std::uint32_t* sums) {
  for (int x = 0; x < count; ++x) sums[x] += pixels[x];
}

template <Simd simd>
LIBOCC_INLINE void add_bytes_body(const std::uint8_t* pixels, int count, std::uint32_t* sums) {
  add_pixels_body<std::uint8_t, simd>(pixels, count, sums);
}
LIBOCC_MULTIVERSION(add_bytes, (const std::uint8_t* pixels, int count, std::uint32_t* sums),
                    (pixels, count, sums))

template <Simd simd>
LIBOCC_INLINE void add_words_body(const std::uint16_t* pixels, int count, std::uint32_t* sums) {
  add_pixels_body<std::uint16_t, simd>(pixels, count, sums);
}
LIBOCC_MULTIVERSION(add_words, (const std::uint16_t* pixels, int count, std::uint32_t* sums),
                    (pixels, count, sums))

/// Binomial filter of five rows, then of five columns: a Gaussian of sigma 1.
template <Simd>
LIBOCC_INLINE void smooth_row_body(const float* const* rows, int count, float* between, float* to) {
  const float *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3], *e = rows[4];
  for (int x = 0; x < count; ++x) between[x] = a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x];
  for (int x = 2; x < count - 2; ++x)
    to[x] =
        (between[x - 2] + between[x + 2] + 4 * (between[x - 1] + between[x + 1]) + 6 * between[x]) *
        (1.0F / 256);
}
LIBOCC_MULTIVERSION(smooth_row, (const float* const* rows, int count, float* between, float* to),
                    (rows, count, between, to))

/// Sums of factor x factor pixels, times `scale`.
class RowReader {
 public:
  RowReader(const Image& grey, int factor, float scale)
      : grey_(grey), factor_(factor), scale_(scale), sums_(static_cast<std::size_t>(grey.width)) {}

  void read(int row, int count, float* to) {
    std::fill(sums_.begin(), sums_.end(), 0U);
    for (int v = 0; v < factor_; ++v) {
      const std::size_t begin =
          static_cast<std::size_t>(row * factor_ + v) * static_cast<std::size_t>(grey_.width);
      if (grey_.type == PixelType::u8)
        add_bytes_(grey_.u8.data() + begin, grey_.width, sums_.data());
      else
        add_words_(grey_.u16.data() + begin, grey_.width, sums_.data());
    }
    const std::uint32_t* from = sums_.data();
    // Signed numbers have an instruction for the conversion; the sums are below 2^31.
    const auto level = [scale = scale_](std::uint32_t sum) {
      return scale * static_cast<float>(static_cast<std::int32_t>(sum));
    };
    if (factor_ == 1) {
      for (int x = 0; x < count; ++x) to[x] = level(from[x]);
      return;
    }
    for (int x = 0; x < count; ++x, from += factor_)
      to[x] = level(std::accumulate(from, from + factor_, 0U));
  }

 private:
  const Image& grey_;
  int factor_;
  float scale_;
  std::vector<std::uint32_t> sums_;
  decltype(add_bytes_for(Simd::baseline)) add_bytes_ = add_bytes_for(widest_simd());
  decltype(add_words_for(Simd::baseline)) add_words_ = add_words_for(widest_simd());
};

}  // namespace

GreyLevel::GreyLevel(const Image& grey, unsigned white, int factor)
    : width_(grey.width / factor), height_(grey.height / factor), factor_(factor) {
  const auto row_size = static_cast<std::size_t>(width_);
  smooth_.assign(row_size * static_cast<std::size_t>(height_), 0.0F);
  if (width_ < 5 || height_ < 5) return;
  const float scale = 255.0F / (static_cast<float>(white) * static_cast<float>(factor * factor));
  RowReader reader(grey, factor, scale);
  std::vector<float> kept(5 * row_size), between(row_size);
  const auto kept_row = [&](int y) {
    return kept.data() + static_cast<std::size_t>(y % 5) * row_size;
  };
  const auto smooth = smooth_row_for(widest_simd());
  for (int y = 0; y < height_; ++y) {
    reader.read(y, width_, kept_row(y));
    if (y < 4) continue;
    const float* rows[5];
    for (int k = 0; k < 5; ++k) rows[k] = kept_row(y - 4 + k);
    smooth(rows, width_, between.data(),
           smooth_.data() + static_cast<std::size_t>(y - 2) * row_size);
  }
}

}  // namespace occ::internal::landmarks
