// SPDX-License-Identifier: Apache-2.0
// How points lie about their centroid: on a line, in a plane, in space.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

struct PointLayout {
  Eigen::Vector3d centroid;
  Eigen::Matrix3d axes;    ///< principal axes in columns, widest first, right-handed
  Eigen::Vector3d extent;  ///< root of the sum of squares along each
};

PointLayout point_layout(const Eigen::Matrix3Xd& points);

/// Whether the extent across the best line or plane is more than rounding.
bool spans_plane(const PointLayout& layout);
bool spans_space(const PointLayout& layout);

}  // namespace occ::internal::pose
