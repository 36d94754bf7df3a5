// SPDX-License-Identifier: Apache-2.0
// Solver "posit": four or more points in space by POSIT.
//
// Iterates the scaled orthographic pose: with w_i = 1 + r_3 . p_i / t_z, the corrected image points
// are w_i u_i = (r_1 . p_i + t_x) / t_z and w_i v_i = (r_2 . p_i + t_y) / t_z. Points are relative
// to their centroid; its image is estimated as well.
//
// Domain: points not in a plane; bearings within 89.9 degrees of their mean. Converges from a few
// sizes away, see `failures`.
// Source: DeMenthon, Davis, "Model-based object pose in 25 lines of code", IJCV 15, 1995.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver posit_solver;  ///< POSIT for points in space.

}  // namespace occ
