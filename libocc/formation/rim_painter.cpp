// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/internal/rim_painter.hpp"

#include <cstdint>
#include <cstring>

#include "libocc/core/internal/multiversion.hpp"

namespace occ {
namespace {

constexpr int padding = 8;  // elements of the widest vector

template <Simd>
struct Doubles {
  typedef double Vector __attribute__((vector_size(16), may_alias));
};
template <>
struct Doubles<Simd::avx2> {
  typedef double Vector __attribute__((vector_size(32), may_alias));
};
template <>
struct Doubles<Simd::avx512> {
  typedef double Vector __attribute__((vector_size(64), may_alias));
};
static_assert(sizeof(Doubles<Simd::avx512>::Vector) == padding * sizeof(double));

/// A point to paint: rows of tables around its offset, `columns` apart, and outer products added to
/// sums in rows `row` apart, a row's three sums `other` apart. Weights of the rows are multiplied
/// by `amount`.
struct Stroke {
  const double *steps, *moment_steps, *weights, *moment_weights;
  std::ptrdiff_t columns;
  double amount;
  PsfStencil across, down;
  Footprint print;
  double* sums;  // of the canvas, aligned to the widest vector
  std::ptrdiff_t row, other;
  double* buffer;  // 4 columns + 3 padding
};

/// Two tables at once.
LIBOCC_INLINE void interpolate(const double* __restrict a, const double* __restrict b,
                               std::ptrdiff_t n, const PsfStencil& at, double factor,
                               double* __restrict out_a, double* __restrict out_b) {
  const double w0 = at.weight[0], w1 = at.weight[1], w2 = at.weight[2], w3 = at.weight[3];
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    out_a[k] = factor * (w0 * a[k] + w1 * a[k + n] + w2 * a[k + 2 * n] + w3 * a[k + 3 * n]);
    out_b[k] = factor * (w0 * b[k] + w1 * b[k + n] + w2 * b[k + 2 * n] + w3 * b[k + 3 * n]);
  }
}

/// Steps left of the canvas are taken in its first column.
LIBOCC_INLINE void gather(int first_column, double* steps) {
  for (int k = 0; k < first_column; ++k) {
    steps[first_column] += steps[k];
    steps[k] = 0;
  }
}

template <Simd simd, bool with_moments>
LIBOCC_INLINE void stroke(const Stroke& job) {
  using Vector = typename Doubles<simd>::Vector;
  constexpr int lanes = sizeof(Vector) / sizeof(double);
  const std::ptrdiff_t columns = job.columns, row = job.row, other = job.other;
  // Zeros before, between and after what is painted.
  double *across = job.buffer + padding, *moment_across = across + columns + padding;
  double *down = moment_across + columns + padding, *moment_down = down + columns;
  interpolate(job.steps, job.moment_steps, columns, job.across, 1, across, moment_across);
  interpolate(job.weights, job.moment_weights, columns, job.down, job.amount, down, moment_down);
  gather(job.print.first_column, across);
  gather(job.print.first_column, moment_across);
  // From the aligned column before the first.
  const int first = job.print.first_column - (job.print.left + job.print.first_column) % padding;
  for (int i = first; i < job.print.end_column; i += lanes) {
    Vector step, moment_step;
    std::memcpy(&step, across + i, sizeof step);
    std::memcpy(&moment_step, moment_across + i, sizeof step);
    double* to = job.sums + (job.print.top + job.print.first_row) * row + job.print.left + i;
    for (int k = job.print.first_row; k < job.print.end_row; ++k, to += row) {
      Vector* c = reinterpret_cast<Vector*>(to);
      *c += down[k] * step;
      if constexpr (with_moments) {
        *reinterpret_cast<Vector*>(to + other) += down[k] * moment_step;
        *reinterpret_cast<Vector*>(to + 2 * other) += moment_down[k] * step;
      }
    }
  }
}

template <Simd simd>
LIBOCC_INLINE void plain_stroke_body(Stroke job) {
  stroke<simd, false>(job);
}
LIBOCC_MULTIVERSION(plain_stroke, (Stroke job), (job))

template <Simd simd>
LIBOCC_INLINE void moments_stroke_body(Stroke job) {
  stroke<simd, true>(job);
}
LIBOCC_MULTIVERSION(moments_stroke, (Stroke job), (job))

/// Running sums of `lines` lines at once: one addition waits for the one before it on its line.
template <int lines>
void running_sums(const double* from, std::ptrdiff_t from_stride, int width, double* to) {
  double sum[lines] = {};
  for (int x = 0; x < width; ++x)
    for (int line = 0; line < lines; ++line) {
      sum[line] += from[line * from_stride + x];
      to[line * static_cast<std::ptrdiff_t>(width) + x] = sum[line];
    }
}

void sum_lines(const double* from, std::ptrdiff_t from_stride, int width, int height, double* to) {
  constexpr int lines = 6;
  int y = 0;
  for (; y + lines <= height; y += lines)
    running_sums<lines>(from + y * from_stride, from_stride, width,
                        to + y * static_cast<std::ptrdiff_t>(width));
  for (; y < height; ++y)
    running_sums<1>(from + y * from_stride, from_stride, width,
                    to + y * static_cast<std::ptrdiff_t>(width));
}

}  // namespace

Canvas::Canvas(Simd simd, const PsfTables& tables, int width, int height, bool with_moments)
    : simd_(simd),
      tables_(tables),
      width_(width),
      height_(height),
      with_moments_(with_moments),
      stride_((width + 2 * padding - 1) / padding * padding),
      steps_(static_cast<std::size_t>(stride_ * (with_moments ? 3 : 1)) *
                 static_cast<std::size_t>(height) +
             padding),
      buffer_(4 * tables.columns + 3 * padding) {
  const auto address = reinterpret_cast<std::uintptr_t>(steps_.data()) / sizeof(double);
  begin_ = (padding - address % padding) % padding;
}

void Canvas::paint(const Footprint& print, const PsfStencil& across, const PsfStencil& down,
                   double amount) {
  const std::size_t before = across.bin * tables_.columns, above = down.bin * tables_.columns;
  const Stroke stroke{tables_.steps + before,
                      tables_.moment_steps + before,
                      tables_.weights + above,
                      tables_.moment_weights + above,
                      static_cast<std::ptrdiff_t>(tables_.columns),
                      amount,
                      across,
                      down,
                      print,
                      steps_.data() + begin_,
                      stride_ * (with_moments_ ? 3 : 1),
                      stride_,
                      buffer_.data()};
  (with_moments_ ? moments_stroke_for(simd_) : plain_stroke_for(simd_))(stroke);
}

void Canvas::sum(double* c, double* m_x, double* m_y) const {
  const std::ptrdiff_t row = stride_ * (with_moments_ ? 3 : 1);
  const double* steps = steps_.data() + begin_;
  sum_lines(steps, row, width_, height_, c);
  if (!with_moments_) return;
  sum_lines(steps + stride_, row, width_, height_, m_x);
  sum_lines(steps + 2 * stride_, row, width_, height_, m_y);
}

}  // namespace occ
