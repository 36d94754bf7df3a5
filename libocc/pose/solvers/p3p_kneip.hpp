// SPDX-License-Identifier: Apache-2.0
// Solver "p3p_kneip": three points, OpenGV's implementation without any guard.
//
// The camera's pose follows from the roots of a quartic in the cotangent of one angle.
//
// Domain: three points that are not collinear. Loses poses in symmetric configurations, see
// `failures`.
// Source: Kneip, Scaramuzza, Siegwart, "A novel parametrization of the perspective-three-point
// problem for a direct computation of absolute camera position and orientation", CVPR 2011.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// P3P after Kneip; requires LIBOCC_OPENGV.
LIBOCC_API extern const Solver p3p_kneip_solver;

}  // namespace occ
