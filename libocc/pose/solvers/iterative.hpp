// SPDX-License-Identifier: Apache-2.0
// Solver "iterative": OpenCV's SOLVEPNP_ITERATIVE.
//
// Linear start (homography for points in a plane, otherwise direct linear transformation), then
// Levenberg-Marquardt on the reprojection error.
//
// Domain: four or more points in a plane, or six or more in space; bearings within 89.9 degrees of
// their mean.
// Source: OpenCV 4.6, module calib3d, solvePnP.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// SOLVEPNP_ITERATIVE; requires LIBOCC_OPENCV.
LIBOCC_API extern const Solver iterative_solver;

}  // namespace occ
