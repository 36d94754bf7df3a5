// SPDX-License-Identifier: Apache-2.0
// Blur of a lamp by the lens of a scene, in addition to the box of the pixel:
//
//   Gaussian   sigma^2 = psf_sigma_px^2 + (0.42 lambda N / pitch)^2     the second term when the
//              scene asks for diffraction: the core of the Airy disc
//   defocus    a uniform disc of radius |1/z - 1/z_f| fx fy pitch / (2 N)   [px]
//
// z, z_f: depths of lamp and focus along the optical axis. That is the thin lens: a point at z is
// imaged at v_z behind a lens of diameter D, and its cone meets the sensor at v = f_px pitch in a
// circle of diameter D |1 - v/v_z| = D v |1/z - 1/z_f|; D = v / N as in formation/light.hpp. The
// circle does not depend on the direction, and its centre is where the pinhole sees the point.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::formation {

LIBOCC_API double gaussian_blur_px(const Scene& scene);

/// Radius of the disc that blurs a lamp at a depth; 0 for a scene without focus_distance_m.
LIBOCC_API double defocus_radius_px(const Scene& scene, double depth_m);

/// A share of the light and its displacement from the pinhole projection of its source.
struct BlurShift {
  Eigen::Vector2d px;
  double weight;
};

/// A uniform disc as a sum of displacements, for light that is also blurred by a Gaussian and the
/// pixel: rings at the nodes of a Gauss-Legendre rule in the radius. Accurate to 1e-3 of a point's
/// peak for sigmas from 0.3 px and to 5e-4 from 0.5 px (measured). A single zero for radius zero.
LIBOCC_API std::vector<BlurShift> disc_shifts(double radius_px, double sigma_px);

}  // namespace occ::internal::formation
