// SPDX-License-Identifier: Apache-2.0
// Tables of the pixel response: a Gaussian PSF convolved with the pixel's box. For a pixel at a
// distance u to the right of the light, along one axis,
//     B(u) = Phi((u + 1/2)/sigma) - Phi((u - 1/2)/sigma),
//     G(u) = running integral of B,
//     F(u) = running integral of -u B(u),
//     B'(u), B''(u) the derivatives of B,
// with Phi the normal distribution. The functions are tabulated once per sigma on a fine grid of
// sub-pixel offsets. Cubic interpolation gives a row of pixels for a few multiplications each,
// without erf.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Weights of four table rows, `bin` being the first, for cubic interpolation at a sub-pixel
/// offset.
struct PsfStencil {
  std::size_t bin = 0;    ///< index of the first of four table rows
  double weight[4] = {};  ///< weights of rows bin to bin + 3; their sum is 1
};

/// Lagrange cubic through the two table rows on each side of an offset, 0 <= fraction < 1. The
/// tables have `bins` rows per pixel.
inline PsfStencil psf_stencil(double fraction, int bins) {
  const double at = fraction * bins;
  const int below = static_cast<int>(at), bin = below < bins ? below : bins - 1;
  const double t = at - bin, below_t = t + 1, above_t = t - 1, far_t = t - 2;
  return {static_cast<std::size_t>(bin),
          {t * above_t * far_t * (-1.0 / 6), below_t * above_t * far_t * 0.5,
           below_t * t * far_t * -0.5, below_t * t * above_t * (1.0 / 6)}};
}

/// Pointers to the tables. A row belongs to one sub-pixel offset; there are `bins` rows per pixel,
/// and the first row is one before offset 0. Rows are padded with zeros to `columns`, a multiple
/// of 8. The tables of moments are null in single precision.
template <typename Real>
struct PsfTables {
  std::size_t columns = 0;                                   ///< length of a row, padding included
  int bins = 0, reach = 0;                                   ///< rows per pixel; PixelPsf::reach()
  const Real *weights = nullptr, *moment_weights = nullptr;  ///< tables of B and of -u B
  /// Tables of the differences of G and of F.
  const Real *steps = nullptr, *moment_steps = nullptr;
};

/// Tables of the pixel response for one width of the PSF.
class LIBOCC_API PixelPsf {
 public:
  /// Throws std::invalid_argument unless 0.01 <= psf_sigma_px <= 100.
  explicit PixelPsf(double psf_sigma_px);

  /// Standard deviation of the Gaussian, without the pixel's box.
  double sigma_px() const { return sigma_; }

  /// Light at a position x reaches the pixels floor(x) - reach() ... floor(x) + reach() + 1. Pixels
  /// farther away receive less than 6e-7 of it.
  int reach() const { return reach_; }
  int count() const { return 2 * reach_ + 2; }  ///< number of these pixels

  // In the following functions, 0 <= fraction < 1 is the position minus its floor, and out[0]
  // belongs to the first of these pixels.

  /// count() values of B; their sum is 1.
  void weights(double fraction, double* out) const { interpolate(weights_, fraction, out); }

  /// count() values of -u B(u), the first moment of the light about each pixel.
  void moment_weights(double fraction, double* out) const {
    interpolate(moment_weights_, fraction, out);
  }

  /// count() values of B'.
  void slopes(double fraction, double* out) const { interpolate(slopes_, fraction, out); }

  /// count() values of B''. Computed without a table, because only point lamps need it.
  void curvatures(double fraction, double* out) const;

  /// count() + 1 differences of G between neighbouring pixels, from 0 before the first pixel to 1
  /// after the last; their sum is 1.
  void steps(double fraction, double* out) const { interpolate(steps_, fraction, out); }

  /// count() + 1 differences of F; their sum is 0.
  void moment_steps(double fraction, double* out) const {
    interpolate(moment_steps_, fraction, out);
  }

  /// Tables for loops with their own interpolation.
  template <typename Real>
  PsfTables<Real> tables() const {
    if constexpr (sizeof(Real) == sizeof(float))
      return {columns_, bins_, reach_, float_weights_.data(), nullptr, float_steps_.data(),
              nullptr};
    else
      return {columns_,
              bins_,
              reach_,
              weights_.values.data(),
              moment_weights_.values.data(),
              steps_.values.data(),
              moment_steps_.values.data()};
  }

 private:
  struct Table {
    std::size_t used = 0;  // columns without padding
    std::vector<double> values;
  };

  void tabulate();
  void interpolate(const Table& table, double fraction, double* out) const;

  double sigma_ = 0;
  int reach_ = 0;
  int bins_ = 0;             // rows per pixel; one row more on both sides
  std::size_t columns_ = 0;  // number of columns of each table, with padding
  Table weights_, moment_weights_, slopes_, steps_, moment_steps_;
  std::vector<float> float_weights_, float_steps_;
};

}  // namespace occ
