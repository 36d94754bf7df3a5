// SPDX-License-Identifier: Apache-2.0
// How a camera pans and tilts on the way along a route.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

struct PanTiltKnot {
  double along_m = 0;  ///< of the route
  double pan_rad = 0, tilt_rad = 0;
};

/// Straight between knots; before the first and after the last as there. Pans may exceed pi.
struct LIBOCC_API PanTiltPlan {
  std::vector<PanTiltKnot> knots;

  PanTiltKnot at(double along_m) const;

  /// Throws std::invalid_argument when there is no knot, one is not finite, or along_m decreases.
  void validate() const;
};

}  // namespace occ
