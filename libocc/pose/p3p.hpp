// SPDX-License-Identifier: Apache-2.0
// Perspective-three-point: every pose from which three known points are seen along three known
// bearings. Solver: OpenGV's p3p_kneip (Kneip, Scaramuzza, Siegwart, "A novel parametrization of
// the perspective-three-point problem", CVPR 2011), guarded: points are first moved to their
// centroid and scaled to unit size; candidates that are not finite, have a point behind the camera
// or do not reproduce the bearings are dropped; the rest are polished by Newton's method on the
// three distance equations, and duplicates merged.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <vector>

#include "libocc/geometry/rigid.hpp"

namespace occ {

/// All candidates for cam_from_world (0 to 4), best reprojection first.
/// bearings: columns, unit to 1e-6, camera frame; points_in_world: columns [m].
/// Empty for collinear or coincident points and for bearings that fit no triangle. Throws
/// std::invalid_argument for values that are not finite or bearings that are not unit.
LIBOCC_API std::vector<Rigid3> p3p(const Eigen::Matrix3d& bearings,
                                   const Eigen::Matrix3d& points_in_world);

}  // namespace occ
