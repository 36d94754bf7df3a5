// SPDX-License-Identifier: Apache-2.0
// Solver "triangle": three points by the numeric triangle method.
//
// The search runs over one angle of the triangle (camera, corner, another corner). The law of sines
// gives the distances of both points; the third distance then has two values, and the length of the
// triangle's third side selects the roots.
//
// Domain: three points that are not collinear and three distinct bearings. Finds all roots, double
// roots included, but slowly.
// Source: DeMenthon, lecture "Object pose from a single image".
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver triangle_solver;  ///< Numeric triangle method.

}  // namespace occ
