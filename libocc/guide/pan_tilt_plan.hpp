// SPDX-License-Identifier: Apache-2.0
// Pan and tilt of a camera as functions of the distance along a route.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Angles of the camera at one point of the route.
struct PanTiltKnot {
  double along_m = 0;                ///< distance along the route
  double pan_rad = 0, tilt_rad = 0;  ///< see guide/mount.hpp
};

/// Linear interpolation between knots; constant before the first and after the last. Pans may
/// exceed pi.
struct LIBOCC_API PanTiltPlan {
  std::vector<PanTiltKnot> knots;  ///< sorted by along_m

  /// Angles at a distance along the route [m].
  PanTiltKnot at(double along_m) const;

  /// Throws std::invalid_argument if there is no knot, a knot is not finite, or along_m decreases.
  void validate() const;
};

}  // namespace occ
