// SPDX-License-Identifier: Apache-2.0
// Blur by the lens, in addition to the pixel's box:
//
//   Gaussian   sigma^2 = psf_sigma_px^2 + (0.42 lambda N / pitch)^2
//              The second term is the core of the Airy disc, if the scene includes diffraction.
//   defocus    uniform disc of radius |1/z - 1/z_f| fx fy pitch / (2 N)   [px]
//
// z and z_f are the depths of lamp and focus along the optical axis. Defocus follows the thin lens:
// a point at z is imaged at v_z behind a lens of diameter D. Its cone of light meets the sensor at
// v = f_px pitch in a circle of diameter D |1 - v/v_z| = D v |1/z - 1/z_f|, with D = v / N as in
// formation/light.hpp. The circle does not depend on the direction; its centre is the pinhole
// projection of the point.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::formation {

/// Standard deviation of the Gaussian part [px].
LIBOCC_API double gaussian_blur_px(const Scene& scene);

/// Radius of the defocus disc of a lamp at a depth [px]; 0 for a scene without focus_distance_m.
LIBOCC_API double defocus_radius_px(const Scene& scene, double depth_m);

/// A fraction of the light, and its displacement from the pinhole projection of its source.
struct BlurShift {
  Eigen::Vector2d px;
  double weight;
};

/// Represents a uniform disc by shifts, on rings at the nodes of a Gauss-Legendre rule in the
/// radius. The light is also blurred by a Gaussian of sigma_px and by the pixel's box. The error is
/// 1e-3 of a point's peak for sigmas from 0.3 px on, and 5e-4 from 0.5 px on (measured). A radius
/// of zero gives one shift of zero.
LIBOCC_API std::vector<BlurShift> disc_shifts(double radius_px, double sigma_px);

}  // namespace occ::internal::formation
