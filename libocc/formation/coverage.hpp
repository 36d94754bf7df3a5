// SPDX-License-Identifier: Apache-2.0
// The image of a uniform shape under a Gaussian PSF and the pixel's box, as a contour integral
// along its rim (Green's theorem):
//     I(i, j) = closed integral of Gx(x_i - x(t)) By(y_j - y(t)) y'(t) dt
// with By the box-blurred Gaussian and Gx the running integral of the box-blurred Gaussian. The
// trapezoid rule converges spectrally for a smooth rim: `spacing` is the dial between accuracy and
// time.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <vector>

namespace occ {

/// A rectangle of pixels with a value each, row by row.
struct Patch {
  int x0 = 0, y0 = 0, width = 0, height = 0;
  std::vector<double> values;
  double at(int x, int y) const {
    return values[static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x - x0)];
  }
};

/// Fraction 0..1 of each pixel's light that the shape inside `rim_px` (closed polygon of samples of
/// a smooth curve, at most about one PSF sigma apart) gives, over its bounding box grown by 4.5
/// sigma + 1 and clipped to the image. psf_sigma_px > 0.
LIBOCC_API Patch coverage(const std::vector<Eigen::Vector2d>& rim_px, double psf_sigma_px,
                          int image_width, int image_height);

/// The same for a point source of unit flux at `px`: the PSF integrated over each pixel.
LIBOCC_API Patch point_coverage(const Eigen::Vector2d& px, double psf_sigma_px, int image_width,
                                int image_height);

}  // namespace occ
