// SPDX-License-Identifier: Apache-2.0
// Response of a pixel to light around it: a Gaussian PSF convolved with the box of the pixel,
//     B(u) = Phi((u + 1/2)/sigma) - Phi((u - 1/2)/sigma)         along one axis,
//     G(u) = running integral of B,
//     F(u) = running integral of -u B(u)
//     B'(u), B''(u) the derivatives of B
// at a pixel u to the right of the light (Phi: the normal distribution). For each sigma they are
// tabulated once at many sub-pixel offsets and interpolated by cubics, so a row of neighbouring
// pixels costs a few multiplications each and no call of erf.
#pragma once

#include <cstddef>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Cubic interpolation in the tables at one sub-pixel offset: weights of four rows, `bin` the
/// first.
struct PsfStencil {
  std::size_t bin = 0;
  double weight[4] = {};
};

/// Lagrange's cubic through the two table rows on each side of an offset, 0 <= fraction < 1, of
/// tables with `bins` rows per pixel.
inline PsfStencil psf_stencil(double fraction, int bins) {
  const double at = fraction * bins;
  const int below = static_cast<int>(at), bin = below < bins ? below : bins - 1;
  const double t = at - bin, below_t = t + 1, above_t = t - 1, far_t = t - 2;
  return {static_cast<std::size_t>(bin),
          {t * above_t * far_t * (-1.0 / 6), below_t * above_t * far_t * 0.5,
           below_t * t * far_t * -0.5, below_t * t * above_t * (1.0 / 6)}};
}

/// The tables: one row per sub-pixel offset, padded with zeros to `columns`, a multiple of 8;
/// `bins` rows per pixel, the first one before offset 0. There are no tables of moments in single
/// precision.
template <typename Real>
struct PsfTables {
  std::size_t columns = 0;
  int bins = 0, reach = 0;
  const Real *weights = nullptr, *moment_weights = nullptr;
  const Real *steps = nullptr, *moment_steps = nullptr;
};

class LIBOCC_API PixelPsf {
 public:
  /// Throws std::invalid_argument unless 0.01 <= psf_sigma_px <= 100.
  explicit PixelPsf(double psf_sigma_px);

  double sigma_px() const { return sigma_; }

  /// A position touches the pixels floor(position) - reach() ... floor(position) + reach() + 1;
  /// beyond is less than 6e-7 of its light.
  int reach() const { return reach_; }
  int count() const { return 2 * reach_ + 2; }  ///< pixels touched

  // In the following, 0 <= fraction < 1 is the position minus its floor, and out[0] belongs to the
  // first touched pixel.

  /// count() values of B, which sum to 1.
  void weights(double fraction, double* out) const { interpolate(weights_, fraction, out); }

  /// count() values of -u B(u): the light's first moment about each pixel.
  void moment_weights(double fraction, double* out) const {
    interpolate(moment_weights_, fraction, out);
  }

  /// count() values of B'.
  void slopes(double fraction, double* out) const { interpolate(slopes_, fraction, out); }

  /// count() values of B'': not tabulated, for point lamps only.
  void curvatures(double fraction, double* out) const;

  /// Differences of G from each touched pixel to the next, from 0 before the first to 1 after the
  /// last: count() + 1 values, which sum to 1.
  void steps(double fraction, double* out) const { interpolate(steps_, fraction, out); }

  /// Differences of F like those of G: count() + 1 values, which sum to 0.
  void moment_steps(double fraction, double* out) const {
    interpolate(moment_steps_, fraction, out);
  }

  /// Returns the tables for loops that interpolate themselves.
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
    std::size_t used = 0;  // of the columns
    std::vector<double> values;
  };

  void tabulate();
  void interpolate(const Table& table, double fraction, double* out) const;

  double sigma_ = 0;
  int reach_ = 0;
  int bins_ = 0;             // per pixel of offset; rows are from one before the first to one after
  std::size_t columns_ = 0;  // of each table
  Table weights_, moment_weights_, slopes_, steps_, moment_steps_;
  std::vector<float> float_weights_, float_steps_;
};

}  // namespace occ
