// SPDX-License-Identifier: Apache-2.0
// Solver "upright_p2p": two points when the direction of gravity is known; cameras or rigs.
//
// With R = A Rz(heading), where A takes the world's Z to `up_in_cam`, the side D = P_1 - P_2 and
// the normal n = f_1 x f_2 of the plane of both bearings fulfil n . (R D) = n . (o_1 - o_2), hence
//     a cos(heading) + b sin(heading) + c = 0.
// It is solved for the angle: the paper's unknown tan(heading / 2) is infinite at pi.
//
// Domain: the heading is undetermined when both points are at the camera's height or one is above
// the other; then nothing is returned.
// Source: Kukelova, Bujnak, Pajdla, "Closed-form solutions to minimal absolute pose problems with
// known vertical direction", ACCV 2010.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver upright_p2p_solver;  ///< P2P with known vertical.

}  // namespace occ
