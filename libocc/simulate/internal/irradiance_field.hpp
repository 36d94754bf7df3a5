// SPDX-License-Identifier: Apache-2.0
// Irradiance of an extended lamp at every pixel of a rectangle. It varies slowly (over the focal
// length, not over pixels), so it is evaluated on a coarse grid and interpolated by cubics.
#pragma once

#include "libocc/formation/coverage.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// E [W/m^2] at the pixels x0 <= x < x1, y0 <= y < y1. Pixels whose ray does not meet the lamp's
/// lit side, or that lie outside the camera's domain, get the irradiance at the lamp's centre: only
/// the tail of the PSF is there.
Patch irradiance_field(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                       const Sensor& sensor, int x0, int y0, int x1, int y1,
                       Simd simd = widest_simd());

}  // namespace occ
