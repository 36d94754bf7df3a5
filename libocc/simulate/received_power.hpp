// SPDX-License-Identifier: Apache-2.0
// Power of the lamps' light that the lens takes in and that falls on the sensor:
//
//   P = integral over the lamp's face of  L(phi) cos(phi) A cos(psi) / d^2 dS               [W]
//
// of those parts of the face that the camera sees: their projection lies on the sensor (the field
// of view, lens distortion included), they shine towards the camera, and no box is in between. A
// lamp seen whole and from afar has the P of the aperture formula at its centre
// (radiometry/lambertian.hpp) to (size/d)^2; half a lamp in view gives its half. Blinking lamps are
// taken while they are lit, and the lens's vignetting is in it. What light other than the lamps'
// own falls on the sensor is not, and `scene.effects`, which is about images, has no say.
//
// The face is cut into cells, those at a border into smaller ones: a whole lamp's power is good to
// 3e-5 (from as near as its size, better from afar), that of a lamp which a border cuts to 1e-3 of
// the whole lamp's.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct ReceivedLamp {
  double power_w = 0;
  bool whole = false;  ///< all of its face is seen
};

struct LIBOCC_API ReceivedPower {
  std::vector<ReceivedLamp> lamps;  ///< in the scene's order

  double total_w() const;
  int visible() const;  ///< lamps of which some light arrives
};

/// For each pose. A camera inside a box sees nothing. Throws std::invalid_argument when the scene
/// does not validate or a pose is not finite.
LIBOCC_API std::vector<ReceivedPower> received_power(const Scene& scene,
                                                     const std::vector<Rigid3>& cam_from_world);
LIBOCC_API ReceivedPower received_power(const Scene& scene, const Rigid3& cam_from_world);

}  // namespace occ
