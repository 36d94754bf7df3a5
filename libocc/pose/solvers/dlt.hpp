// SPDX-License-Identifier: Apache-2.0
// Solver "dlt": six or more points in space by the direct linear transformation.
//
// The 3x4 projection P fulfils f_i x (P X_i) = 0: two linear equations for each bearing in a basis
// of its tangent plane. The pose is the nearest rotation to the left 3x3 block of P, and its last
// column over the block's mean singular value.
//
// Domain: points not in a plane; any field of view.
// Source: Hartley, Zisserman, "Multiple view geometry in computer vision", 2nd ed., 2004, section
// 7.1.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver dlt_solver;  ///< Direct linear transformation.

}  // namespace occ
