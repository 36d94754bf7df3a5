// SPDX-License-Identifier: Apache-2.0
// Converts coverage to electrons for rows of a lamp's image, by the lamp's irradiance.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/coverage.hpp"

namespace occ::internal::simulate {

/// A patch with zeros after each row, up to a whole number of vectors.
struct PaddedPatch {
  static constexpr int padding = 8;
  int x0 = 0, y0 = 0, width = 0, height = 0;
  std::ptrdiff_t stride = 0;
  std::vector<float> values;

  PaddedPatch() = default;
  explicit PaddedPatch(const Patch& patch);

  /// Sets the size. Values are undefined except for the zeros; storage is reused.
  void resize(int left, int top, int columns, int rows);

  float* row(int y) { return values.data() + y * stride; }
  const float* row(int y) const { return values.data() + y * stride; }
};

/// Irradiance on a row and on the rows above and below, from one pixel left of the first.
struct RowLight {
  const float *here, *above, *below;
  double electrons;      ///< electrons of a fully covered pixel per W/m^2
  double half_variance;  ///< half the variance of the PSF and the pixel's box [px^2]
  int count;
};

/// Converts coverage `c` to electrons, with the moments m_x and m_y of the coverage.
void light_row(Simd simd, const RowLight& light, const double* m_x, const double* m_y, double* c);

/// Like above, with moments computed by the taps of a MomentFilter from rows of coverage, `stride`
/// apart.
void light_row(Simd simd, const RowLight& light, const float* c, std::ptrdiff_t stride,
               const std::array<double, 4>& taps, float* to);

/// Like above, under constant irradiance.
void light_row(Simd simd, double electrons, const float* c, int count, float* to);

}  // namespace occ::internal::simulate
