// SPDX-License-Identifier: Apache-2.0
// Computes the power of the lamps' direct light that enters the lens and falls on the sensor:
//
//   P = integral over the lamp's face of  L(phi) cos(phi) A cos(psi) / d^2 dS               [W]
//
// with the radiance L, the emission angle phi, the lens's aperture area A, the angle of incidence
// psi and the distance d. The integral covers the parts of the face that the camera sees: they
// project onto the sensor (lens distortion included), they face the camera, and no box hides them.
// For a distant lamp seen as a whole, the aperture formula at its centre
// (radiometry/lambertian.hpp) has a relative error of (size/d)^2. Blinking lamps count with their
// power while lit. Vignetting is included. Other light is not, and `scene.effects` is ignored
// because it only concerns images.
//
// The face is divided into cells, smaller ones at a border. The relative error is 3e-5 for a whole
// lamp at a distance of its own size (less for farther lamps), and 1e-3 of the whole lamp's power
// for a lamp that is cut by a border.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Direct light of one lamp.
struct ReceivedLamp {
  double power_w = 0;  ///< through the lens onto the sensor; 0 if not visible
  bool whole = false;  ///< its whole face is visible
};

/// Direct light of all lamps at one pose.
struct LIBOCC_API ReceivedPower {
  std::vector<ReceivedLamp> lamps;  ///< in the order of the scene

  /// Sum over all lamps.
  double total_w() const;
  int visible() const;  ///< number of lamps with a positive power
};

/// Received power for each pose. A camera inside a box receives nothing. Throws
/// std::invalid_argument if the scene does not validate or a pose is not finite.
LIBOCC_API std::vector<ReceivedPower> received_power(const Scene& scene,
                                                     const std::vector<Rigid3>& cam_from_world);
/// Received power for one pose.
LIBOCC_API ReceivedPower received_power(const Scene& scene, const Rigid3& cam_from_world);

}  // namespace occ
