// SPDX-License-Identifier: Apache-2.0
// Internal: the distances of three points from the camera.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/distance_equations.hpp"

namespace occ::internal::pose {

struct Root {
  double depth[3];
  double misfit = 0;  ///< see distance_equations.hpp
  bool real = true;   ///< false for the real part of a complex pair
};

inline constexpr int max_roots = 8;  ///< four, each found twice at worst

/// All real roots with positive distances, to rounding. Two that rounding of the distances cannot
/// tell apart are one, unless `keep_close`: the bearings may tell them apart.
int find_roots(const Triangle& triangle, bool keep_close, Root roots[max_roots]);

/// The real parts of the roots, before any polish: noise in the bearings can turn a double root
/// into a complex pair. At most four; misfit is not set.
int find_real_parts(const Triangle& triangle, Root roots[4]);

}  // namespace occ::internal::pose
