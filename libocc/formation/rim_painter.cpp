// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/internal/rim_painter.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::formation {
namespace {

constexpr std::size_t max_vector_bytes = 64;

template <typename Real>
constexpr int padding = static_cast<int>(max_vector_bytes / sizeof(Real));

template <Simd simd, typename Real>
struct Numbers {
  typedef Real Vector __attribute__((vector_size(16), may_alias));
};
template <typename Real>
struct Numbers<Simd::avx2, Real> {
  typedef Real Vector __attribute__((vector_size(32), may_alias));
};
template <typename Real>
struct Numbers<Simd::avx512, Real> {
  typedef Real Vector __attribute__((vector_size(64), may_alias));
};

template <typename Real>
struct Job {
  const PaintedRimPoint* rim;
  std::ptrdiff_t points;
  PsfTables<Real> tables;
  Real* pixels;  // pixels of the canvas, aligned to the widest vector
  int width, height;
  std::ptrdiff_t row, other;  // strides between rows, and between the values of a row
  Real* buffer;               // 4 columns + 3 padding
};

/// Pixels of the canvas that a point's light reaches. Of the rows that it reaches, counted from 0
/// at row `top` of the canvas, first_row <= row < end_row are on the canvas; columns likewise.
struct Footprint {
  int top, first_row, end_row, left, first_column, end_column;
};

template <typename Real>
LIBOCC_INLINE void interpolate(const Real* __restrict table, std::ptrdiff_t n, const PsfStencil& at,
                               double by, Real* __restrict out) {
  const auto w0 = static_cast<Real>(at.weight[0]), w1 = static_cast<Real>(at.weight[1]);
  const auto w2 = static_cast<Real>(at.weight[2]), w3 = static_cast<Real>(at.weight[3]);
  const auto factor = static_cast<Real>(by);
  for (std::ptrdiff_t k = 0; k < n; ++k)
    out[k] = factor *
             (w0 * table[k] + w1 * table[k + n] + w2 * table[k + 2 * n] + w3 * table[k + 3 * n]);
}

/// Interpolates in two tables.
LIBOCC_INLINE void interpolate(const double* a, const double* b, std::ptrdiff_t n,
                               const PsfStencil& at, double factor, double* out_a, double* out_b) {
  interpolate(a, n, at, factor, out_a);
  interpolate(b, n, at, factor, out_b);
}

/// Adds steps left of the canvas to its first column.
template <typename Real>
LIBOCC_INLINE void gather(int first_column, Real* steps) {
  for (int k = 0; k < first_column; ++k) {
    steps[first_column] += steps[k];
    steps[k] = 0;
  }
}

/// Adds outer products to the canvas, from the aligned column at or before the first.
template <Simd simd, bool with_moments, typename Real>
LIBOCC_INLINE void add_products(const Job<Real>& job, const Footprint& footprint,
                                const Real* across, const Real* moment_across, const Real* down,
                                const Real* moment_down) {
  using Vector = typename Numbers<simd, Real>::Vector;
  constexpr int lanes = sizeof(Vector) / sizeof(Real);
  const std::ptrdiff_t row = job.row, other = job.other;
  const int first = footprint.first_column - (footprint.left + footprint.first_column) % lanes;
  for (int i = first; i < footprint.end_column; i += lanes) {
    Vector step, moment_step;
    std::memcpy(&step, across + i, sizeof step);
    std::memcpy(&moment_step, moment_across + i, sizeof step);
    Real* to = job.pixels + (footprint.top + footprint.first_row) * row + footprint.left + i;
#pragma GCC unroll 6
    for (int k = footprint.first_row; k < footprint.end_row; ++k, to += row) {
      *reinterpret_cast<Vector*>(to) += down[k] * step;
      if constexpr (with_moments) {
        *reinterpret_cast<Vector*>(to + other) += down[k] * moment_step;
        *reinterpret_cast<Vector*>(to + 2 * other) += moment_down[k] * step;
      }
    }
  }
}

template <Simd simd, bool with_moments, typename Real>
LIBOCC_INLINE void paint_point(const Job<Real>& job, const PaintedRimPoint& point) {
  const int reach = job.tables.reach, count = 2 * reach + 2;
  // Compared as floating-point numbers, because a point may be outside the range of int.
  const double x = __builtin_floor(point.x), y = __builtin_floor(point.y);
  const double row = y - reach, column = x - reach;
  if (!(row + count > 0 && row < job.height && column < job.width)) return;
  Footprint footprint;
  footprint.top = static_cast<int>(row);
  footprint.first_row = footprint.top < 0 ? -footprint.top : 0;
  footprint.end_row = count < job.height - footprint.top ? count : job.height - footprint.top;
  footprint.left = column > -count ? static_cast<int>(column) : -count;
  footprint.first_column = footprint.left < 0 ? -footprint.left : 0;
  footprint.end_column =
      count + 1 < job.width - footprint.left ? count + 1 : job.width - footprint.left;

  const auto columns = static_cast<std::ptrdiff_t>(job.tables.columns);
  // The buffer has zeros before, between and after the interpolated values.
  Real *across = job.buffer + padding<Real>, *moment_across = across + columns + padding<Real>;
  Real *down = moment_across + columns + padding<Real>, *moment_down = down + columns;
  const PsfStencil at_x = psf_stencil(point.x - x, job.tables.bins);
  const PsfStencil at_y = psf_stencil(point.y - y, job.tables.bins);
  const std::ptrdiff_t before = static_cast<std::ptrdiff_t>(at_x.bin) * columns;
  const std::ptrdiff_t above = static_cast<std::ptrdiff_t>(at_y.bin) * columns;
  if constexpr (with_moments) {
    interpolate(job.tables.steps + before, job.tables.moment_steps + before, columns, at_x, 1,
                across, moment_across);
    interpolate(job.tables.weights + above, job.tables.moment_weights + above, columns, at_y,
                point.dy, down, moment_down);
    gather(footprint.first_column, moment_across);
  } else {
    interpolate(job.tables.steps + before, columns, at_x, 1, across);
    interpolate(job.tables.weights + above, columns, at_y, point.dy, down);
  }
  gather(footprint.first_column, across);
  add_products<simd, with_moments>(job, footprint, across, moment_across, down, moment_down);
}

template <Simd simd>
LIBOCC_INLINE void paint_floats_body(Job<float> job) {
  for (std::ptrdiff_t i = 0; i < job.points; ++i) paint_point<simd, false>(job, job.rim[i]);
}
LIBOCC_MULTIVERSION(paint_floats, (Job<float> job), (job))

template <Simd simd>
LIBOCC_INLINE void paint_doubles_body(Job<double> job) {
  for (std::ptrdiff_t i = 0; i < job.points; ++i) paint_point<simd, false>(job, job.rim[i]);
}
LIBOCC_MULTIVERSION(paint_doubles, (Job<double> job), (job))

template <Simd simd>
LIBOCC_INLINE void paint_moments_body(Job<double> job) {
  for (std::ptrdiff_t i = 0; i < job.points; ++i) paint_point<simd, true>(job, job.rim[i]);
}
LIBOCC_MULTIVERSION(paint_moments, (Job<double> job), (job))

void paint_all(Simd simd, const Job<float>& job, bool) { paint_floats_for(simd)(job); }
void paint_all(Simd simd, const Job<double>& job, bool with_moments) {
  (with_moments ? paint_moments_for(simd) : paint_doubles_for(simd))(job);
}

/// Computes the running sums of `lines` lines in place. Several lines are summed at a time, because
/// each addition depends on the one before on its line.
template <int lines, typename Real>
void running_sums(Real* values, std::ptrdiff_t stride, int width) {
  double sum[lines] = {};
  for (int x = 0; x < width; ++x)
    for (int line = 0; line < lines; ++line) {
      sum[line] += static_cast<double>(values[line * stride + x]);
      values[line * stride + x] = static_cast<Real>(sum[line]);
    }
}

}  // namespace

template <typename Real>
void Canvas<Real>::prepare(int width, int height, bool with_moments) {
  width_ = width;
  height_ = height;
  with_moments_ = with_moments;
  rim_.clear();
  // The zeros after a row are also the zeros before the next.
  constexpr int lanes = padding<Real>;
  stride_ = lanes + (width + lanes - 1) / lanes * lanes;
  const std::ptrdiff_t needed = row_stride() * (height + 2 * margin) + 2 * lanes;
  if (static_cast<std::ptrdiff_t>(pixels_.size()) < needed)
    pixels_.resize(static_cast<std::size_t>(needed));
  std::fill_n(pixels_.begin(), needed, Real{});
  begin_ = margin * row_stride() + lanes;
  const auto address = reinterpret_cast<std::uintptr_t>(pixels_.data()) / sizeof(Real);
  begin_ += static_cast<std::ptrdiff_t>((lanes - address % lanes) % lanes);
}

template <typename Real>
void Canvas<Real>::paint(const PixelPsf& psf) {
  const auto tables = psf.tables<Real>();
  buffer_.assign(4 * tables.columns + 3 * padding<Real>, Real{});
  const Job<Real> job{rim_.data(),   static_cast<std::ptrdiff_t>(rim_.size()),
                      tables,        pixels_.data() + begin_,
                      width_,        height_,
                      row_stride(),  stride_,
                      buffer_.data()};
  paint_all(simd_, job, with_moments_);
}

template <typename Real>
void Canvas<Real>::sum() {
  constexpr int lines = 8;
  Real* const first = pixels_.data() + begin_;
  const int all = with_moments_ ? 3 * height_ : height_;
  int line = 0;
  for (; line + lines <= all; line += lines)
    running_sums<lines>(first + line * stride_, stride_, width_);
  for (; line < all; ++line) running_sums<1>(first + line * stride_, stride_, width_);
  // Whole vectors were painted, so values right of the canvas are reset.
  for (line = 0; line < all; ++line)
    std::fill_n(first + line * stride_ + width_, padding<Real>, Real{});
}

template class Canvas<float>;
template class Canvas<double>;

}  // namespace occ::internal::formation
