// SPDX-License-Identifier: Apache-2.0
// Solver "p3p_gao": three points, OpenGV's implementation without any guard.
//
// Wu-Ritt's zero decomposition of Grunert's distance equations into triangular sets.
//
// Domain: three points that are not collinear. Loses digits at narrow views, see `failures`.
// Source: Gao, Hou, Tang, Cheng, "Complete solution classification for the perspective-three-point
// problem", PAMI 25(8), 2003.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// P3P after Gao; requires LIBOCC_OPENGV.
LIBOCC_API extern const Solver p3p_gao_solver;

}  // namespace occ
