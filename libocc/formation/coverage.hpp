// SPDX-License-Identifier: Apache-2.0
// Computes the image of a uniform shape under a Gaussian PSF and the pixel's box, as a contour
// integral along its rim (Green's theorem):
//
//     I(i, j) = closed integral of G(x_i - x(t)) B(y_j - y(t)) y'(t) dt
//
// with B the Gaussian convolved with the pixel's box, and G its running integral
// (formation/pixel_psf.hpp). The trapezoid rule converges spectrally for a smooth rim; the spacing
// of the contour's points sets accuracy against time. Largest error measured for discs of 0.05 to
// 300 px and sigma 0.2 to 5: 5e-7 of a fully covered pixel at a spacing of 1 sigma, 2e-4 at
// 1.5 sigma.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/simd.hpp"
#include "libocc/formation/contour.hpp"
#include "libocc/formation/pixel_psf.hpp"

namespace occ {

namespace internal::formation {
template <typename Real>
class Canvas;
}

/// Values of a rectangle of pixels, row by row; width and height are 0 if it is empty.
template <typename Real>
struct PatchOf {
  int x0 = 0, y0 = 0, width = 0, height = 0;  ///< upper left pixel in the image, and size
  std::vector<Real> values;                   ///< width x height values, row by row
  /// Value of a pixel of the image, which must lie inside the patch.
  Real at(int x, int y) const {
    return values[static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x - x0)];
  }
};
using Patch = PatchOf<double>;  ///< in double precision

/// Coverage: the fraction 0..1 of each pixel's light that comes from inside the contour. The patch
/// is the contour's bounding box, extended by the PSF's reach and clipped to the image. The contour
/// may have either orientation.
LIBOCC_API Patch coverage(const Contour& contour, const PixelPsf& psf, int image_width,
                          int image_height, Simd simd = widest_simd());

/// View of the coverage in a CoveragePainter's memory, with an error of 3e-7. Rows are `stride`
/// values apart. `margin` more pixels around the rectangle can be read; they hold the coverage
/// there, also outside the image.
struct CoverageRows {
  static constexpr int margin = 4;            ///< readable pixels on each side of the rectangle
  int x0 = 0, y0 = 0, width = 0, height = 0;  ///< upper left pixel in the image, and size
  const float* first = nullptr;               ///< value of pixel (x0, y0)
  std::ptrdiff_t stride = 0;                  ///< values from one row to the next
};

/// Computes coverage() of many contours, in single precision and in the same memory.
class LIBOCC_API CoveragePainter {
 public:
  /// `simd`: instruction set to use; all give the same bits.
  explicit CoveragePainter(Simd simd = widest_simd());
  CoveragePainter(CoveragePainter&&) noexcept;
  CoveragePainter& operator=(CoveragePainter&&) noexcept;
  ~CoveragePainter();

  /// The result is valid until the next call.
  CoverageRows paint(const Contour& contour, const PixelPsf& psf, int image_width,
                     int image_height);

 private:
  std::unique_ptr<internal::formation::Canvas<float>> canvas_;
};

/// Coverage with its first moments about each pixel's centre: (x - x_i) and (y - y_j), weighted
/// like the light. Under the irradiance E + grad E . (p - p_ij), the value of a pixel is
///     E c + grad E . (m_x, m_y).
struct CoverageMoments {
  Patch c, m_x, m_y;  ///< patches of equal extent
};
/// Coverage and moments of a contour; patch and orientation as for coverage().
LIBOCC_API CoverageMoments coverage_moments(const Contour& contour, const PixelPsf& psf,
                                            int image_width, int image_height,
                                            Simd simd = widest_simd());
/// Like coverage_moments above, into `out`, whose storage is reused.
LIBOCC_API void coverage_moments(const Contour& contour, const PixelPsf& psf, int image_width,
                                 int image_height, Simd simd, CoverageMoments& out);

/// Coverage with its moments and derivatives. The derivative by motion is a contour integral as
/// well:
///     d c = closed integral of K(p_ij - p(t)) (motion x step),   K(u, v) = B(u) B(v).
/// The derivative by the PSF's width follows from the heat equation:
///     dc / d sigma^2 = Laplacian(c) / 2.
struct CoverageDerivatives {
  CoverageMoments moments;  ///< coverage and first moments
  /// dc / d (rotation of the lamp about its centre, translation of its centre, ln psf sigma) for
  /// each pixel of the patches, with an error of 1e-4 of the largest. The eighth value is
  /// undefined.
  using Row = std::array<float, 8>;
  std::vector<Row> d;  ///< one row per pixel of the patches
};
/// Computes them into `out`, whose storage is reused.
LIBOCC_API void coverage_derivatives(const MovingContour& contour, const PixelPsf& psf,
                                     int image_width, int image_height, CoverageDerivatives& out);

/// Coverage from samples of a smooth closed curve, evenly spaced in a parameter (smooth_contour)
/// and at most about one PSF sigma apart.
LIBOCC_API Patch coverage(const std::vector<Eigen::Vector2d>& rim_px, double psf_sigma_px,
                          int image_width, int image_height);

/// Image of a point source of unit flux at `px`: the PSF integrated over each pixel.
LIBOCC_API Patch point_coverage(const Eigen::Vector2d& px, const PixelPsf& psf, int image_width,
                                int image_height);
/// Overload that tabulates the PSF of a sigma first.
LIBOCC_API Patch point_coverage(const Eigen::Vector2d& px, double psf_sigma_px, int image_width,
                                int image_height);

}  // namespace occ
