// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/corner_kernel.hpp"

#include <cstdint>
#include <cstring>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::landmarks {
namespace {

constexpr float two_by_root_pi = 1.12837917F;

/// exp(x) for -80 <= x <= 0: 2^k times a polynomial of the fraction, with a relative error of 2e-7.
LIBOCC_INLINE float exp_of(float x) {
  constexpr float log2_e = 1.44269504F, ln_2 = 0.693147181F;
  const float scaled = x * log2_e;
  const auto whole = static_cast<std::int32_t>(scaled - 0.5F);  // rounds, as scaled <= 0
  const float r = (scaled - static_cast<float>(whole)) * ln_2;  // at most ln(2) / 2
  const float power =
      1 + r * (1 + r * (1.0F / 2 + r * (1.0F / 6 + r * (1.0F / 24 + r * (1.0F / 120 + r / 720)))));
  const std::int32_t bits = (whole + 127) << 23;  // 2^whole as IEEE 754 single
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return power * scale;
}

/// min(x, 6) for x >= 0. The bits of such numbers are in their order; the compiler turns a
/// comparison of the numbers into a branch, which keeps it from vectorising the loop.
LIBOCC_INLINE float at_most_6(float x) {
  constexpr std::int32_t bits_of_6 = 0x40C00000;
  std::int32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  bits = bits < bits_of_6 ? bits : bits_of_6;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// An edge across the window: erf(z) + c z^3 exp(-z^2), its derivative by z, and that by c. erf is
/// approximated to 1.5e-7 (Abramowitz, Stegun, "Handbook of mathematical functions", 1964,
/// eq. 7.1.26).
struct BlurredEdge {
  float value, slope, by_overshoot;
};

LIBOCC_INLINE BlurredEdge blurred_edge(float z_of_edge, float overshoot) {
  // The bell is below 3e-16 there. Smaller ones, squared, would be numbers below the normal range,
  // which take Intel's processors a hundred times as long.
  const float size = at_most_6(__builtin_fabsf(z_of_edge));
  const float z = __builtin_copysignf(size, z_of_edge);
  const float z2 = z * z, bell = exp_of(-z2);
  const float t = 1 / (1 + 0.3275911F * size);
  const float tail =
      t * (0.254829592F +
           t * (-0.284496736F + t * (1.421413741F + t * (-1.453152027F + t * 1.061405429F))));
  const float of_size = 1 - tail * bell, by_overshoot = z * z2 * bell;
  return {__builtin_copysignf(of_size, z) + overshoot * by_overshoot,
          (two_by_root_pi + overshoot * z2 * (3 - 2 * z2)) * bell, by_overshoot};
}

constexpr int row_count = corner_unknowns + 1;
using Rows = float[row_count][kernel_lanes];

/// Rows of kernel_lanes pixels. Copies of all arguments keep the compiler from assuming that a row
/// overlaps an argument.
LIBOCC_INLINE void evaluate_lanes(const CornerParameters& p, float per_px,
                                  const float (&pixels)[4][kernel_lanes], Rows& to) {
  const float inverse_blur = 1 / p.blur_px;
  constexpr float root_half = 0.707106781F;
  for (int i = 0; i < kernel_lanes; ++i) {
    const float x = pixels[0][i], y = pixels[1][i], grey = pixels[2][i], in = pixels[3][i];
    const float gx = x * per_px, gy = y * per_px;
    const float dx = x - p.centre_x, dy = y - p.centre_y;
    const float q1 = (p.cosine[0] * dy - p.sine[0] * dx) * inverse_blur;
    const float q2 = (p.cosine[1] * dy - p.sine[1] * dx) * inverse_blur;
    const BlurredEdge e1 = blurred_edge(root_half * q1, p.overshoot);
    const BlurredEdge e2 = blurred_edge(root_half * q2, p.overshoot);
    const float step = p.step + p.step_x * gx + p.step_y * gy;
    const float scale = in * step * root_half * inverse_blur;
    const float by_1 = scale * e1.slope * e2.value, by_2 = scale * e2.slope * e1.value;
    to[0][i] = by_1 * p.sine[0] + by_2 * p.sine[1];
    to[1][i] = -by_1 * p.cosine[0] - by_2 * p.cosine[1];
    to[2][i] = -by_1 * (p.cosine[0] * dx + p.sine[0] * dy);
    to[3][i] = -by_2 * (p.cosine[1] * dx + p.sine[1] * dy);
    to[4][i] = -(by_1 * q1 + by_2 * q2);
    const float product = in * e1.value * e2.value;
    to[5][i] = in;
    to[6][i] = in * gx;
    to[7][i] = in * gy;
    to[8][i] = product;
    to[9][i] = product * gx;
    to[10][i] = product * gy;
    to[11][i] = in * step * (e1.by_overshoot * e2.value + e2.by_overshoot * e1.value);
    const float model = in * (p.level + p.level_x * gx + p.level_y * gy) + step * product;
    to[12][i] = in * grey - model;
  }
}

template <Simd>
LIBOCC_INLINE void evaluate_body(const CornerParameters& parameters, const CornerWindow& w,
                                 float* rows) {
  const CornerParameters p = parameters;
  const float* const from[4] = {w.x, w.y, w.grey, w.inside};
  const float per_px = w.per_px;
  for (int first = 0; first < w.count; first += kernel_lanes) {
    float pixels[4][kernel_lanes];
    Rows lanes;
    for (int k = 0; k < 4; ++k) std::memcpy(pixels[k], from[k] + first, sizeof pixels[k]);
    evaluate_lanes(p, per_px, pixels, lanes);
    for (int k = 0; k < row_count; ++k)
      std::memcpy(rows + k * w.count + first, lanes[k], sizeof lanes[k]);
  }
}
LIBOCC_MULTIVERSION(evaluate, (const CornerParameters& p, const CornerWindow& w, float* rows),
                    (p, w, rows))

constexpr int folded_lanes = 4;
static_assert(kernel_lanes == 32, "lanes are folded by halves");

/// Sums of each lane of a[i] b_k[i] for `dots` rows b_k, each folded to four in a fixed order. The
/// sums of several rows do not wait for one another.
template <int dots>
LIBOCC_INLINE void add_lanes(const float* a, const float* const* b, int count, float* sums) {
  alignas(64) float lanes[dots][kernel_lanes];
  for (int d = 0; d < dots; ++d)
    for (int k = 0; k < kernel_lanes; ++k) lanes[d][k] = a[k] * b[d][k];
  for (int i = kernel_lanes; i < count; i += kernel_lanes)
    for (int d = 0; d < dots; ++d)
      for (int k = 0; k < kernel_lanes; ++k) lanes[d][k] += a[i + k] * b[d][i + k];
  for (int d = 0; d < dots; ++d) {
    for (int k = 0; k < 16; ++k) lanes[d][k] += lanes[d][k + 16];
    for (int k = 0; k < 8; ++k) lanes[d][k] += lanes[d][k + 8];
    for (int k = 0; k < folded_lanes; ++k)
      sums[d * folded_lanes + k] = lanes[d][k] + lanes[d][k + folded_lanes];
  }
}

template <Simd simd>
LIBOCC_INLINE void lane_sums_body(const float* a, const float* const* b, int dots, int count,
                                  float* sums) {
  constexpr int together = simd == Simd::avx512 ? 4 : 2;  // as many as the registers hold
  int d = 0;
  for (; d + together <= dots; d += together)
    add_lanes<together>(a, b + d, count, sums + d * folded_lanes);
  for (; d < dots; ++d) add_lanes<1>(a, b + d, count, sums + d * folded_lanes);
}
LIBOCC_MULTIVERSION(lane_sums,
                    (const float* a, const float* const* b, int dots, int count, float* sums),
                    (a, b, dots, count, sums))

}  // namespace

void evaluate_corner(const CornerParameters& parameters, const CornerWindow& window, float* rows) {
  evaluate_for(widest_simd())(parameters, window, rows);
}

void lane_dots(const float* a, const float* const* b, int dots, int count, double* to) {
  static const auto sums_of = lane_sums_for(widest_simd());
  constexpr int most = 16;
  float sums[most * folded_lanes];
  for (int first = 0; first < dots; first += most) {
    const int some = dots - first < most ? dots - first : most;
    sums_of(a, b + first, some, count, sums);
    for (int d = 0; d < some; ++d) {
      const float* four = sums + d * folded_lanes;
      to[first + d] =
          (static_cast<double>(four[0]) + four[1]) + (static_cast<double>(four[2]) + four[3]);
    }
  }
}

}  // namespace occ::internal::landmarks
