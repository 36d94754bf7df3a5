// SPDX-License-Identifier: Apache-2.0
// A lit lamp's image in electrons and its derivatives: what a fit of the image itself needs.
//
//   electrons(p) = E(p) c(p) + grad E . (m_x, m_y)(p)      extended lamp: formation/coverage.hpp
//   electrons(p) = P B(x_p - x) B(y_p - y)                 point lamp: formation/light.hpp
//
// with E the electrons of a fully covered pixel there. E follows from its values on a grid of 5 x 5
// nodes (Lagrange's polynomial of degree 4): good to 1e-5 for lamps smaller than a quarter of the
// focal length.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct LampImage {
  CoverageDerivatives coverage;   ///< its patches say which pixels; for a point lamp `c` is the PSF
  std::vector<double> full;       ///< E, row by row as the patches: d electrons = full d coverage
  std::vector<double> electrons;  ///< mean signal, before clipping
  /// d ln(E) / d (turn of the lamp about its centre, shift of its centre), at its centre. The
  /// derivatives of coverage do not contain it.
  Vector6 d_log_light = Vector6::Zero();

  int x0() const { return coverage.moments.c.x0; }
  int y0() const { return coverage.moments.c.y0; }
  int width() const { return coverage.moments.c.width; }
  int height() const { return coverage.moments.c.height; }
};

/// Renders into `image`, reusing its storage; contour points at most `spacing_px` apart. False when
/// the lamp shows its dark side or is partly outside the camera's domain. Where E varies by a part
/// q over the width of the PSF, the derivatives err by about q.
LIBOCC_API bool render_lamp(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                            const Sensor& sensor, const PixelPsf& psf, double spacing_px,
                            LampImage& image);

}  // namespace occ
