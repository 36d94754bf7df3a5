// SPDX-License-Identifier: Apache-2.0
// Pose of a camera on a vehicle: tilt and height are known; position on the floor and heading are
// not.
//
// A point of known height has a known position relative to the camera, except for a rotation about
// the vertical. The heading follows from a second point or from a compass. In the level frame (z
// up) a point at height h above the camera and bearing f is at f h / f_z. The second point lies on
// the vertical plane of its bearing, at its known horizontal distance from the first: a ray
// intersects a circle.
//
// Domain: one point at least not at the camera's height. These solvers need a height and are
// therefore not in the list of pose/solver.hpp.
// Source: libocc.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/candidates.hpp"

namespace occ {

/// Known quantities of the camera.
struct PlanarCamera {
  Eigen::Vector3d up_in_cam = -Eigen::Vector3d::UnitY();  ///< world's Z axis, unit
  double height_m = 0;                                    ///< z of the camera's centre in the world
};

/// Poses from two points and their unit bearings: up to two, the one with the smaller misfit first.
/// The misfit is the error of the less steep bearing, whose elevation the solution does not use.
/// Empty when both points are at the camera's height, one is above the other, or the bearings
/// contradict the height. Throws std::invalid_argument for values that are not finite or bearings
/// that are not unit.
LIBOCC_API std::vector<PoseCandidate> planar_poses(const Eigen::Matrix<double, 3, 2>& bearings,
                                                   const Eigen::Matrix<double, 3, 2>& points,
                                                   const PlanarCamera& camera);

/// Pose from one point and a known heading (defined by heading_rad). Empty when the point is at the
/// camera's height, the bearing leads away from it, or the image's x axis is vertical and the
/// heading therefore undefined. Throws as above.
LIBOCC_API std::vector<PoseCandidate> planar_poses(const Eigen::Vector3d& bearing,
                                                   const Eigen::Vector3d& point, double heading_rad,
                                                   const PlanarCamera& camera);

}  // namespace occ
