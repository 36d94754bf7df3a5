// SPDX-License-Identifier: Apache-2.0
// How a scene's lens blurs a lamp beside the pixel's box:
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

/// A share of the light and how far it lands from where the pinhole sees its source.
struct BlurShift {
  Eigen::Vector2d px;
  double weight;
};

/// A uniform disc as shifts, for light that a Gaussian and the pixel's box blur besides: rings at
/// the nodes of a Gauss-Legendre rule in the radius. Good to 1e-3 of a point's peak for sigmas from
/// 0.3 px, and to 5e-4 from 0.5 px (measured). One shift, of zero, for a radius of zero.
LIBOCC_API std::vector<BlurShift> disc_shifts(double radius_px, double sigma_px);

}  // namespace occ::internal::formation
