// SPDX-License-Identifier: Apache-2.0
// A lamp's light, row by row: from coverage to electrons.
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

  /// Values are of no meaning but for the zeros; storage is used again.
  void resize(int left, int top, int columns, int rows);

  float* row(int y) { return values.data() + y * stride; }
  const float* row(int y) const { return values.data() + y * stride; }
};

/// The light on a row, from one pixel before the first on: rows above and below say how it changes.
struct RowLight {
  const float *here, *above, *below;
  double electrons;      ///< of a fully covered pixel, for light of 1
  double half_variance;  ///< of the PSF blurred by the pixel [px^2]
  int count;
};

/// Coverage `c` to electrons, with its moments.
void light_row(Simd simd, const RowLight& light, const double* m_x, const double* m_y, double* c);

/// The same with moments by a MomentFilter's taps, from rows of coverage `stride` apart.
void light_row(Simd simd, const RowLight& light, const float* c, std::ptrdiff_t stride,
               const std::array<double, 4>& taps, float* to);

/// Under even light.
void light_row(Simd simd, double electrons, const float* c, int count, float* to);

}  // namespace occ::internal::simulate
