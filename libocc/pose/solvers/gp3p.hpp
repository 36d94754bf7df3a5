// SPDX-License-Identifier: Apache-2.0
// Solver "gp3p": three points, each observed from its own centre on a rig. OpenGV's implementation.
//
// Groebner basis of the equations R p_i + t = o_i + d_i f_i in the rig's rotation (Cayley
// parameters) and the three distances d_i.
//
// Domain: three points that are not collinear. OpenGV eliminates without pivoting, and Cayley
// parameters are infinite at 180 degrees; therefore the world is rotated and solved again when no
// pose reproduces the bearings.
// Source: Kneip, Furgale, Siegwart, "Using multi-camera systems in robotics: efficient solutions to
// the NPnP problem", ICRA 2013.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// P3P for a rig; requires LIBOCC_OPENGV.
LIBOCC_API extern const Solver gp3p_solver;

}  // namespace occ
