// SPDX-License-Identifier: Apache-2.0
// Solver "ippe": both poses of four or more points in a plane, OpenCV's implementation.
//
// The first-order behaviour of the homography at one point of the plane determines two rotations in
// closed form; the translation of each is a linear least-squares problem.
//
// Domain: points in a plane, not collinear; bearings within 89.9 degrees of their mean.
// Source: Collins, Bartoli, "Infinitesimal plane-based pose estimation", IJCV 109, 2014.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver ippe_solver;  ///< IPPE; requires LIBOCC_OPENCV.

}  // namespace occ
