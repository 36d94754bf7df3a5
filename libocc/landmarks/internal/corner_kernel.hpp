// SPDX-License-Identifier: Apache-2.0
// Internal: inner loops of the fit of a corner, for several instruction sets. Single precision is
// enough: rounding moves a corner by less than 1e-4 px.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ::internal::landmarks {

constexpr int corner_unknowns = 12;
/// Counts of pixels are multiples of it. Sums of several registers do not wait for one another.
constexpr int kernel_lanes = 32;

/// Values of the model of corner_fit.hpp. Gradients are per half window.
struct CornerParameters {
  float centre_x = 0, centre_y = 0;            ///< offset of the corner from the window's middle
  float cosine[2] = {1, 0}, sine[2] = {0, 1};  ///< directions of the edges
  float blur_px = 1;
  float level = 0, level_x = 0, level_y = 0;  ///< a_0 and a
  float step = 0, step_x = 0, step_y = 0;     ///< b_0 and b
  float overshoot = 0;                        ///< c
};

/// Pixels of a window. `inside` is 1, and 0 for the padding.
struct CornerWindow {
  const float *x, *y, *grey, *inside;
  int count;
  float per_px;  ///< 1 / half window
};

/// Derivatives by centre x, y, angles 1, 2, blur, level, level x, y, step, step x, y,
/// overshoot, and then measured - model: 13 rows of `count` values.
void evaluate_corner(const CornerParameters& parameters, const CornerWindow& window, float* rows);

/// Sums of a[i] b_k[i] for `dots` rows b_k; `count` is a multiple of kernel_lanes.
void lane_dots(const float* a, const float* const* b, int dots, int count, double* to);

}  // namespace occ::internal::landmarks
