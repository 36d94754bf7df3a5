// SPDX-License-Identifier: Apache-2.0
// Symmetry between two hypotheses of an ambiguous image: the motion that maps the lamps of one
// hypothesis to those that the other one assigns to the same blobs. Computed by least squares
// (Kabsch) and accepted if the residual is at most 5 % of the lamps' spread.
#pragma once

#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Kinds of motion between two hypotheses.
enum class SymmetryKind {
  rotation,     ///< about an axis
  translation,  ///< rotation by less than 0.01 rad
  screw,        ///< rotation about an axis and translation along it
  planar_flip,  ///< both hypotheses assign the same lamps, with different camera poses
  none,         ///< the map does not repeat, or fewer than three blobs are in both hypotheses
};

/// Motion from one hypothesis to another.
struct Symmetry {
  SymmetryKind kind = SymmetryKind::none;  ///< `none`: no motion fits
  Rigid3 world_from_world;  ///< maps the lamps and the camera of the best hypothesis to the rival's
  double misfit_m = 0;      ///< root mean square residual of the lamps [m]
  std::string text;  ///< description: "rotation by 90 deg about the vertical axis through (2, 2)"
};

}  // namespace occ
