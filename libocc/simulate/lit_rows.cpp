// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/lit_rows.hpp"

#include <algorithm>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::simulate {
namespace {

constexpr int row_lanes = PaddedPatch::padding;

// Irradiance of a pixel after blur, and its differences over two pixels.
template <typename Real>
struct PixelLight {
  Real blurred, d_x, d_y;
};
template <typename Real>
LIBOCC_INLINE PixelLight<Real> light_at(const RowLight& row, Real half_variance, int x) {
  const float* e = row.here + 1 + x;
  const Real here = e[0], left = e[-1], right = e[1], up = row.above[x + 1],
             down = row.below[x + 1];
  return {here + half_variance * (left + right + up + down - 4 * here), right - left, down - up};
}

template <Simd>
LIBOCC_INLINE void by_moments_body(RowLight row, const double* m_x, const double* m_y, double* c) {
  for (int x = 0; x < row.count; ++x) {
    const PixelLight<double> light = light_at(row, row.half_variance, x);
    c[x] = row.electrons * (light.blurred * c[x] + 0.5 * (light.d_x * m_x[x] + light.d_y * m_y[x]));
  }
}
LIBOCC_MULTIVERSION(by_moments, (RowLight row, const double* m_x, const double* m_y, double* c),
                    (row, m_x, m_y, c))

// Taps of a MomentFilter times half the electrons, for differences of the light over two pixels.
struct Taps {
  float t1, t2, t3, t4;
};

LIBOCC_INLINE float filtered(const Taps& taps, const float* at, std::ptrdiff_t step) {
  return taps.t1 * (at[step] - at[-step]) + taps.t2 * (at[2 * step] - at[-2 * step]) +
         taps.t3 * (at[3 * step] - at[-3 * step]) + taps.t4 * (at[4 * step] - at[-4 * step]);
}

LIBOCC_INLINE void light_pixels(const RowLight& row, const float* c, std::ptrdiff_t stride,
                                const Taps& taps, int first, int count, float* __restrict to) {
  const auto electrons = static_cast<float>(row.electrons);
  const auto half_variance = static_cast<float>(row.half_variance);
  for (int x = first; x < first + count; ++x) {
    const PixelLight<float> light = light_at(row, half_variance, x);
    to[x] = electrons * (light.blurred * c[x]) + light.d_x * filtered(taps, c + x, 1) +
            light.d_y * filtered(taps, c + x, stride);
  }
}

// The last whole vector of a row may overlap the one before, which is faster than single pixels.
template <Simd>
LIBOCC_INLINE void by_filter_body(RowLight row, const float* c, std::ptrdiff_t stride, Taps taps,
                                  float* to) {
  if (row.count < row_lanes) return light_pixels(row, c, stride, taps, 0, row.count, to);
  for (int x = 0; x + row_lanes <= row.count; x += row_lanes)
    light_pixels(row, c, stride, taps, x, row_lanes, to);
  if (row.count % row_lanes != 0)
    light_pixels(row, c, stride, taps, row.count - row_lanes, row_lanes, to);
}
LIBOCC_MULTIVERSION(by_filter,
                    (RowLight row, const float* c, std::ptrdiff_t stride, Taps taps, float* to),
                    (row, c, stride, taps, to))

template <Simd>
LIBOCC_INLINE void evenly_body(float electrons, const float* c, int count, float* to) {
  for (int x = 0; x < count; ++x) to[x] = electrons * c[x];
}
LIBOCC_MULTIVERSION(evenly, (float electrons, const float* c, int count, float* to),
                    (electrons, c, count, to))

}  // namespace

PaddedPatch::PaddedPatch(const Patch& patch) {
  resize(patch.x0, patch.y0, patch.width, patch.height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) row(y)[x] = static_cast<float>(patch.at(x0 + x, y0 + y));
}

void PaddedPatch::resize(int left, int top, int columns, int rows) {
  x0 = left;
  y0 = top;
  width = columns;
  height = rows;
  stride = (columns + padding - 1) / padding * padding;
  const std::ptrdiff_t needed = stride * rows;
  if (static_cast<std::ptrdiff_t>(values.size()) < needed)
    values.resize(static_cast<std::size_t>(needed));
  for (int y = 0; y < rows && columns > 0; ++y) std::fill_n(row(y + 1) - padding, padding, 0.0f);
}

void light_row(Simd simd, const RowLight& light, const double* m_x, const double* m_y, double* c) {
  by_moments_for(simd)(light, m_x, m_y, c);
}

void light_row(Simd simd, const RowLight& light, const float* c, std::ptrdiff_t stride,
               const std::array<double, 4>& taps, float* to) {
  const auto tap = [&](std::size_t i) {
    return static_cast<float>(0.5 * light.electrons * taps[i]);
  };
  by_filter_for(simd)(light, c, stride, {tap(0), tap(1), tap(2), tap(3)}, to);
}

void light_row(Simd simd, double electrons, const float* c, int count, float* to) {
  evenly_for(simd)(static_cast<float>(electrons), c, count, to);
}

}  // namespace occ::internal::simulate
