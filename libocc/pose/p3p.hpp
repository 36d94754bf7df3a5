// SPDX-License-Identifier: Apache-2.0
// Perspective-three-point: every pose from which three known points are seen along three known
// bearings. Solver: OpenGV's p3p_kneip (Kneip, Scaramuzza, Siegwart, "A novel parametrization of
// the perspective-three-point problem", CVPR 2011), guarded: points are first moved to their
// centroid and scaled to unit size; candidates that are not finite, have a point behind the camera
// or do not reproduce the bearings are dropped; the rest are polished by Newton's method on the
// three distance equations
//     (d_i - d_j)^2 + d_i d_j |f_i - f_j|^2 = |P_i - P_j|^2
// (chords instead of cosines: nothing cancels at narrow angles), and duplicates merged. Where
// Kneip's parametrisation is singular (symmetric views, double roots) the points are permuted and
// the answers united. Limits, inherited: one or the other pose may be missing when the camera is
// exactly on an axis or plane of symmetry of the three points or in their plane.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/geometry/rigid.hpp"

namespace occ {

/// All candidates for cam_from_world (0 to 4), best reprojection first.
/// bearings: columns, unit to 1e-6, camera frame; points_in_world: columns [m].
/// Empty for collinear or coincident points and for bearings that fit no triangle. Throws
/// std::invalid_argument for values that are not finite or bearings that are not unit.
LIBOCC_API std::vector<Rigid3> p3p(const Eigen::Matrix3d& bearings,
                                   const Eigen::Matrix3d& points_in_world);

/// For searches over noisy bearings: the poses that reproduce each bearing within tolerance_rad,
/// not polished, in `poses`; returns how many. Noise can turn a double root into a complex pair,
/// which `p3p` rightly refuses; here its real part is kept. Input is not checked.
LIBOCC_API int p3p_within(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
                          double tolerance_rad, std::array<Rigid3, 4>& poses);

}  // namespace occ
