// SPDX-License-Identifier: Apache-2.0
// Solver "posit_coplanar": four or more points in a plane by POSIT.
//
// The scaled orthographic image of a plane has two poses. Each is iterated separately: the image
// points are corrected for perspective by the previous pose.
//
// Domain: points in a plane, not collinear; bearings within 89.9 degrees of their mean. Converges
// from a few sizes away, see `failures`.
// Source: Oberkampf, DeMenthon, Davis, "Iterative pose estimation using coplanar feature points",
// CVIU 63, 1996.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// POSIT for points in a plane.
LIBOCC_API extern const Solver posit_coplanar_solver;

}  // namespace occ
