// SPDX-License-Identifier: Apache-2.0
// Frames in which solvers are accurate, and poses converted to and from them: points in unit size
// about their centroid (`UnitFrame`), image points of a camera turned to the mean bearing
// (`PinholeFrame`), and a world turned by a rotation without symmetry (`generic_rotation`).
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::pose {

/// Points relative to their centroid, in units of their r.m.s. distance from it. Solvers reach
/// rounding accuracy in this frame only.
struct UnitFrame {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double size_m = 1;

  Rigid3 normalised(const Rigid3& cam_from_world) const {
    return {cam_from_world.rotation, (cam_from_world * centroid) / size_m};
  }
  Rigid3 restored(const Rigid3& pose) const {
    return {pose.rotation, size_m * pose.translation - pose.rotation * centroid};
  }
  /// Distance of the points from the world's origin, in units of their size.
  double offset() const { return centroid.norm() / size_m; }
};

/// Converts the points (columns) to their unit frame. Coincident points become NaN.
inline UnitFrame normalise(Eigen::Matrix3Xd& points) {
  UnitFrame frame;
  frame.centroid = points.rowwise().mean();
  points.colwise() -= frame.centroid;
  frame.size_m = std::sqrt(points.squaredNorm() / static_cast<double>(points.cols()));
  points /= frame.size_m;
  return frame;
}

/// For solvers that take image points instead of bearings: the camera is turned so that its z axis
/// is the mean bearing. This keeps the widest possible view in front of the image plane.
struct PinholeFrame {
  Eigen::Matrix3d turned_from_cam;  ///< rotation
  Eigen::Matrix2Xd image;           ///< (x / z, y / z) of the turned bearings

  LIBOCC_API Rigid3 cam_from_world(const Rigid3& turned_from_world) const;
};

/// Returns nothing when a bearing is not finite or more than 89.94 degrees from the mean bearing.
LIBOCC_API std::optional<PinholeFrame> pinhole_frame(const PoseProblem& problem);

/// A fixed rotation without any symmetry. Elimination templates divide by entries that vanish for
/// rotations about a coordinate axis or points along one; in a world turned by it they do not
/// vanish.
inline Eigen::Matrix3d generic_rotation() {
  return Eigen::Quaterniond(0.5377, 0.2931, -0.6453, 0.4549).normalized().toRotationMatrix();
}

}  // namespace occ::internal::pose
