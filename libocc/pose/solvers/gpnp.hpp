// SPDX-License-Identifier: Apache-2.0
// Solver "gpnp": six or more points, observed from several centres on a rig.
//
// EPnP's control points with an inhomogeneous linear system, B_i (sum_k w_ik c_k - o_i) = 0 with
// two rows B_i across bearing i. The search of the system's null space is OpenGV's.
//
// Domain: points not in a plane; at least two different centres (with one centre the system is
// homogeneous).
// Source: Kneip, Furgale, Siegwart, "Using multi-camera systems in robotics: efficient solutions to
// the NPnP problem", ICRA 2013, section IV.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// EPnP for a rig; requires LIBOCC_OPENGV.
LIBOCC_API extern const Solver gpnp_solver;

}  // namespace occ
