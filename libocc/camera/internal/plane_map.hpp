// SPDX-License-Identifier: Apache-2.0
// The camera matrix as a map of the image plane, with its derivatives.
#pragma once

#include <Eigen/Core>

namespace occ::internal::camera {

struct PlaneMap {
  double fx, fy, cx, cy, skew;

  Eigen::Vector2d to_px(const Eigen::Vector2d& p) const {
    return {fx * p.x() + skew * p.y() + cx, fy * p.y() + cy};
  }
  Eigen::Vector2d from_px(const Eigen::Vector2d& px) const {
    const double y = (px.y() - cy) / fy;
    return {(px.x() - cx - skew * y) / fx, y};
  }
  Eigen::Matrix2d d_px() const {
    Eigen::Matrix2d d;
    d << fx, skew, 0, fy;
    return d;
  }
  Eigen::Matrix2d d_plane() const {
    Eigen::Matrix2d d;
    d << 1 / fx, -skew / (fx * fy), 0, 1 / fy;
    return d;
  }
};

}  // namespace occ::internal::camera
