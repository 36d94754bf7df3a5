// SPDX-License-Identifier: Apache-2.0
// Solver "epnp": four or more points in space by EPnP, OpenGV's implementation.
//
// The points are barycentric combinations of four control points. The control points' positions in
// the camera frame are a vector in the null space of a linear system.
//
// Domain: points not in a plane; bearings within 89.9 degrees of their mean.
// Source: Lepetit, Moreno-Noguer, Fua, "EPnP: an accurate O(n) solution to the PnP problem", IJCV
// 81, 2009.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver epnp_solver;  ///< EPnP; requires LIBOCC_OPENGV.

}  // namespace occ
