// SPDX-License-Identifier: Apache-2.0
// Errors that the points of a rim share (Blob::rim_covariance_px2).
#pragma once

#include <Eigen/Core>

#include "libocc/core/math.hpp"

namespace occ::internal::core {

/// Displacement along the normal n of a rim point by each of the common errors.
inline Eigen::Matrix<double, 5, 1> common_rim_errors(const Eigen::Vector2d& n) {
  return {1, n.x(), n.y(), square(n.x()) - square(n.y()), 2 * n.x() * n.y()};
}

}  // namespace occ::internal::core
