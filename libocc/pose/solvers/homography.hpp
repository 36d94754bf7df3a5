// SPDX-License-Identifier: Apache-2.0
// Solver "homography": four or more points in a plane.
//
// The homography H takes a point of the plane to a multiple of its bearing, f_i x (H p_i) = 0; two
// linear equations for each bearing in a basis of its tangent plane. H = s [r_1 r_2 t] yields the
// pose; r_1, r_2 are the nearest orthonormal columns.
//
// Domain: points in a plane, not collinear; any field of view.
// Source: Hartley, Zisserman, "Multiple view geometry in computer vision", 2nd ed., 2004, section
// 4.1; decomposition: Zhang, "A flexible new technique for camera calibration", PAMI 22(11), 2000,
// section 3.1.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// Pose from a plane's homography.
LIBOCC_API extern const Solver homography_solver;

}  // namespace occ
