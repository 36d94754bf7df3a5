// SPDX-License-Identifier: Apache-2.0
// The pose of a camera on wheels: tilt and height are known, where it stands and its heading are
// not. One point of known height then has a known place about the camera but for the heading, which
// a second point tells, or a compass. Unlike the solvers of pose/solver.hpp these take a height,
// and so are no part of that list.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/candidates.hpp"

namespace occ {

/// What is known of the camera.
struct PlanarCamera {
  Eigen::Vector3d up_in_cam = -Eigen::Vector3d::UnitY();  ///< world's Z, unit
  double height_m = 0;                                    ///< its z in the world
};

/// The poses that see two points along two unit bearings: up to two, the smaller misfit first, for
/// the elevation of the lower bearing is not used but measured by it. None where both points are at
/// the camera's height or above one another, or the bearings contradict the height. Throws
/// std::invalid_argument for values that are not finite or bearings that are not unit.
LIBOCC_API std::vector<PoseCandidate> planar_poses(const Eigen::Matrix<double, 3, 2>& bearings,
                                                   const Eigen::Matrix<double, 3, 2>& points,
                                                   const PlanarCamera& camera);

/// The pose of a known heading (as heading_rad defines it) that sees one point: none where the
/// point is at the camera's height, the bearing leads to the other side of it, or the image's right
/// is vertical, which leaves no heading.
LIBOCC_API std::vector<PoseCandidate> planar_poses(const Eigen::Vector3d& bearing,
                                                   const Eigen::Vector3d& point, double heading_rad,
                                                   const PlanarCamera& camera);

}  // namespace occ
