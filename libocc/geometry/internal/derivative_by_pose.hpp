// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::geometry {

/// Derivative of a pixel by the perturbation of the pose (perturb() of Rigid3), from that by the
/// point in the camera's frame. If the perturbation turns about a pivot, the point counts from it.
inline Eigen::Matrix<double, 2, 6> derivative_by_pose(const Eigen::Matrix<double, 2, 3>& by_point,
                                                      const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 2, 6> out;
  out << -by_point * skew(point), by_point;
  return out;
}

}  // namespace occ::internal::geometry
