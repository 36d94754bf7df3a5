// SPDX-License-Identifier: Apache-2.0
// Initial poses for a least-squares fit to points in a plane.
//
// A plane has up to two poses that fit nearly as well. They differ by a reflection of the normal n
// at the direction of view v, which is exact for a distant plane:
//     n' = 2 (v . n) v - n.
// IPPE returns both. In a build without OpenCV, the homography returns one, and the reflection is
// its second.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::pose {

/// Up to two values of cam_from_world, not polished and not tested against the bearings. Empty if
/// the points do not span a plane.
LIBOCC_API std::vector<Rigid3> plane_starts(const PoseProblem& problem);

/// The pose whose plane has the reflected normal; the points' centroid stays in its place.
LIBOCC_API Rigid3 reflected_pose(const PoseProblem& problem, const Rigid3& cam_from_world);

}  // namespace occ::internal::pose
