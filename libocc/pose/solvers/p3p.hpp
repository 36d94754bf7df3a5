// SPDX-License-Identifier: Apache-2.0
// Perspective-three-point: every pose from which three known points are seen along three known
// bearings. The distances of the points solve three quadratic equations
//     (d_i - d_j)^2 + d_i d_j |f_i - f_j|^2 = |P_i - P_j|^2
// (Grunert 1841; chords instead of cosines, so that nothing cancels at narrow angles). They are
// found as the intersections of two conics (pose/internal/conic_pencil.hpp), polished by Newton's
// method and kept when they reproduce the bearings to 3e-12 rad; close to a double root (the camera
// on the cylinder through the points' circle, e.g. exactly under a lamp) its mate is looked for.
// The rotation comes from two orthonormal frames. Far away, or with points nearly on a line, the
// poses are improved once more on the bearings themselves. Two roots that rounding of the input
// cannot tell apart (about 1e-7 of the distance at a double root) are one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// All candidates for cam_from_world (0 to 4), in no order: all fit.
/// bearings: columns, unit to 1e-6, camera frame; points_in_world: columns [m].
/// Empty for collinear or coincident points and for bearings that fit no triangle. Throws
/// std::invalid_argument for values that are not finite or bearings that are not unit.
LIBOCC_API std::vector<Rigid3> p3p(const Eigen::Matrix3d& bearings,
                                   const Eigen::Matrix3d& points_in_world);

/// The same into `poses`, cleared first; returns how many. For loops: input is not checked, except
/// that points on a line give none, and nothing is allocated once `poses` has room for four.
LIBOCC_API int p3p(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
                   std::vector<Rigid3>& poses);

/// For searches over noisy bearings: the poses that reproduce each bearing within tolerance_rad,
/// not polished, in `poses`; returns how many. Noise can turn a double root into a complex pair,
/// which `p3p` rightly refuses; here its real part is kept. Input is not checked.
LIBOCC_API int p3p_within(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
                          double tolerance_rad, std::array<Rigid3, 4>& poses);

}  // namespace occ
