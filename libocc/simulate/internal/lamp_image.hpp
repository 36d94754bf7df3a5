// SPDX-License-Identifier: Apache-2.0
// The image of one lamp without noise, clipping or blinking: mean signal electrons of each pixel.
//
// An extended lamp's irradiance E varies over its image, so a pixel is the integral of E times the
// PSF over the shape. Expanded about the pixel, with c the coverage, (m_x, m_y) its first moments
// and s^2 the variance of PSF and pixel box together, it is
//     (E + s^2/2 laplacian E) c + grad E . (m_x, m_y) + ...
// What is left out changes with the second moment at the rim: 2e-6 to 1e-5 of the peak for focal
// lengths of 200 px and more and a PSF of 0.8 px, 1e-4 at worst for 2 px (measured).
#pragma once

#include <optional>

#include "libocc/formation/coverage.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Empty (width 0) when no light of the lamp reaches the sensor; nothing when it cannot be
/// rendered because part of its rim is outside the camera's domain or it shows its dark side.
std::optional<Patch> lamp_image(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, const Sensor& sensor, const PixelPsf& psf,
                                double spacing_px);

}  // namespace occ
