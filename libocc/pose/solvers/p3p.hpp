// SPDX-License-Identifier: Apache-2.0
// Solver "p3p": every pose from which three known points are observed along three given bearings.
//
// The distances d_i of the points solve three quadratic equations (Grunert 1841)
//     (d_i - d_j)^2 + d_i d_j |f_i - f_j|^2 = |P_i - P_j|^2
// with chords instead of cosines, to avoid cancellation at narrow angles. The roots are
// intersections of two conics, polished by Newton's method and accepted if they reproduce the
// bearings to 3e-12 rad. Close to a double root (camera on the cylinder through the points' circle,
// e.g. exactly under a lamp) both roots of the pair are computed. The rotation follows from two
// orthonormal frames. Far away, or with points nearly on a line, the poses are polished once more
// on the bearings themselves.
//
// Domain: points that are not collinear. Two roots that are closer than rounding of the input
// allows to distinguish (about 1e-7 of the distance at a double root) are merged.
// Source: libocc; conics after Ding, Yang, Larsson, Olsson, Astrom, "Revisiting the P3P Problem",
// CVPR 2023.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/pose/solver.hpp"

namespace occ {

LIBOCC_API extern const Solver p3p_solver;  ///< P3P, libocc's implementation.

/// All candidates for cam_from_world (0 to 4), in no particular order; all of them fit.
/// bearings: columns, unit to 1e-6, camera frame; points_in_world: columns [m].
/// Empty for collinear or coincident points and for bearings that fit no triangle. Throws
/// std::invalid_argument for values that are not finite or bearings that are not unit.
LIBOCC_API std::vector<Rigid3> p3p(const Eigen::Matrix3d& bearings,
                                   const Eigen::Matrix3d& points_in_world);

/// Replaces the content of `poses` and returns the number of candidates. For inner loops: the input
/// is not checked, except that collinear points yield none; nothing is allocated once `poses` has a
/// capacity of four.
LIBOCC_API int p3p(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
                   std::vector<Rigid3>& poses);

/// For searches over noisy bearings: writes the poses that reproduce each bearing within
/// tolerance_rad to `poses`, not polished, and returns their number. Noise can turn a double root
/// into a complex pair, which `p3p` rejects; here its real part is kept. Input is not checked.
LIBOCC_API int p3p_within(const Eigen::Matrix3d& bearings, const Eigen::Matrix3d& points_in_world,
                          double tolerance_rad, std::array<Rigid3, 4>& poses);

}  // namespace occ
