// SPDX-License-Identifier: Apache-2.0
// Solver "p3p_triples": three or more points; the default for more than three.
//
// Solves P3P for up to four triples of points of large area and returns the poses of the triple
// whose best pose has the smallest sum of squared angular residuals over all points, best first.
//
// Domain: points not collinear.
// Source: libocc; P3P of libocc/pose/solvers/p3p.hpp.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

/// P3P over triples of points.
LIBOCC_API extern const Solver p3p_triples_solver;

}  // namespace occ
