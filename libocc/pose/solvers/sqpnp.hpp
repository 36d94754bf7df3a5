// SPDX-License-Identifier: Apache-2.0
// Solver "sqpnp": three or more points by SQPnP, OpenCV's implementation.
//
// Minimises the squared object-space error r^T Omega r over the nine entries r of a rotation matrix
// by sequential quadratic programming, started from several rotations.
//
// Domain: points not collinear; bearings within 89.9 degrees of their mean.
// Source: Terzakis, Lourakis, "A consistently fast and globally optimal solution to the
// perspective-n-point problem", ECCV 2020.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver sqpnp_solver;  ///< SQPnP; requires LIBOCC_OPENCV.

}  // namespace occ
