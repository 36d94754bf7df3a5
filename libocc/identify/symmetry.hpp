// SPDX-License-Identifier: Apache-2.0
// Why an image has several explanations: how the map repeats from one to the other.
#pragma once

#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// What takes one explanation of an image to another.
enum class SymmetryKind {
  turn,         ///< about an axis
  shift,        ///< along the map
  screw,        ///< both
  planar_flip,  ///< the same lamps by the same names, seen from elsewhere
  none,         ///< the blobs in common do not repeat in the map, or are fewer than three
};

struct Symmetry {
  SymmetryKind kind = SymmetryKind::none;
  Rigid3
      world_from_world;  ///< takes what the best explanation sees, and its camera, to the rival's
  double misfit_m = 0;   ///< root mean square of what is left between the lamps
  std::string text;      ///< for people: "turn by 90 deg about the vertical through (2, 2)"
};

}  // namespace occ
