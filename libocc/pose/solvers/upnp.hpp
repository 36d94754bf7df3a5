// SPDX-License-Identifier: Apache-2.0
// Solver "upnp": three or more points, observed from one centre or from several on a rig.
//
// Returns all stationary points of the squared object-space error
//     sum_i |(1 - f_i f_i^T) (R p_i + t - o_i)|^2
// over the rotation's quaternion; t is eliminated. The elimination template is OpenGV's.
//
// Domain: points not collinear.
// Source: Kneip, Li, Seo, "UPnP: an optimal O(n) solution to the absolute pose problem with
// universal applicability", ECCV 2014, eqs (6)-(9).
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// UPnP for one camera or a rig; requires LIBOCC_OPENGV.
LIBOCC_API extern const Solver upnp_solver;

}  // namespace occ
