// SPDX-License-Identifier: Apache-2.0
// Internal: points about their centroid, in units of their size (their r.m.s. distance from it),
// and the way between poses there and in the world. Solvers are exact to rounding in that frame
// alone.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::pose {

struct UnitFrame {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double size_m = 1;

  Rigid3 normalised(const Rigid3& cam_from_world) const {
    return {cam_from_world.rotation, (cam_from_world * centroid) / size_m};
  }
  Rigid3 restored(const Rigid3& pose) const {
    return {pose.rotation, size_m * pose.translation - pose.rotation * centroid};
  }
  /// How far the points are from the world's origin, in units of their size.
  double offset() const { return centroid.norm() / size_m; }
};

/// Takes the points (columns) into their unit frame. Those that coincide are NaN afterwards.
inline UnitFrame normalise(Eigen::Matrix3Xd& points) {
  UnitFrame frame;
  frame.centroid = points.rowwise().mean();
  points.colwise() -= frame.centroid;
  frame.size_m = std::sqrt(points.squaredNorm() / static_cast<double>(points.cols()));
  points /= frame.size_m;
  return frame;
}

}  // namespace occ::internal::pose
