// SPDX-License-Identifier: Apache-2.0
// Computes the image of a lit lamp in electrons, with derivatives, for fits to the pixels of an
// image:
//
//   electrons(p) = E(p) c(p) + grad E . (m_x, m_y)(p)      extended lamp, formation/coverage.hpp
//   electrons(p) = P B(x_p - x) B(y_p - y)                 point lamp, formation/light.hpp
//
// with E the electrons of a fully covered pixel at p. E is interpolated from a grid of 5 x 5 nodes
// by Lagrange polynomials of degree 4. Its error is 1e-5 for lamps smaller than 1/4 of the focal
// length.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Rendered image of one lamp, with derivatives by its motion.
struct LampImage {
  CoverageDerivatives coverage;   ///< its patches hold the pixels; `c` is the PSF for a point lamp
  std::vector<double> full;       ///< E, row by row; d electrons = full d coverage
  std::vector<double> electrons;  ///< mean signal, before clipping
  /// d ln(E) / d (rotation of the lamp about its centre, translation of its centre), at its centre.
  /// It is not included in the derivatives of coverage.
  Vector6 d_log_light = Vector6::Zero();

  /// First column of the patches.
  int x0() const { return coverage.moments.c.x0; }
  /// First row of the patches.
  int y0() const { return coverage.moments.c.y0; }
  /// Columns of the patches; 0 if the lamp is not in the image.
  int width() const { return coverage.moments.c.width; }
  /// Rows of the patches; 0 if the lamp is not in the image.
  int height() const { return coverage.moments.c.height; }
};

/// Renders the lamp into `image`, whose storage is reused, with contour points at most `spacing_px`
/// apart. Returns false if the lamp's dark side is visible or part of it is outside the camera's
/// domain. If E varies by a fraction q over the width of the PSF, the relative error of the
/// derivatives is about q.
LIBOCC_API bool render_lamp(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                            const Sensor& sensor, const PixelPsf& psf, double spacing_px,
                            LampImage& image);

}  // namespace occ
