// SPDX-License-Identifier: Apache-2.0
// Errors of the corners of a blob.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "libocc/core/blob.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::core {

/// Growth of the rim of a blob that is far above full scale [px].
constexpr double over_exposed_growth_px = 3;

/// Covariance of a corner relative to the blob's centroid [px^2]. `model_sigma_px`: error of the
/// camera model. `growth_px`: standard deviation of the growth of the rim beyond what the blob
/// states; all sides move outwards, and the corner with them.
inline Eigen::Matrix2d corner_covariance_px2(const Blob& blob, std::size_t corner,
                                             double model_sigma_px, double growth_px) {
  constexpr double fit_px = 0.3;         // sides that are not straight, rounded corners
  constexpr double max_lengthening = 3;  // of a sharp corner, over its sides
  constexpr double end_variance = 4;     // of a line at its end, over that in its middle
  const std::size_t n = blob.corners_px.size();
  const Eigen::Vector2d& at = blob.corners_px[corner];
  const Eigen::Vector2d before = (at - blob.corners_px[(corner + n - 1) % n]).normalized();
  const Eigen::Vector2d after = (at - blob.corners_px[(corner + 1) % n]).normalized();
  // Both sides move by one pixel along their normals.
  const double sine = std::abs(before.x() * after.y() - before.y() * after.x());
  const Eigen::Vector2d outward = (before + after) / std::max(sine, 1 / max_lengthening);
  double side_variance = 0;
  for (const RimPoint& point : blob.rim) side_variance += square(point.sigma_px);
  if (!blob.rim.empty())
    side_variance *= static_cast<double>(n) / square(static_cast<double>(blob.rim.size()));
  const double variance = square(fit_px) + square(model_sigma_px) + end_variance * side_variance +
                          blob.rim_covariance_px2(3, 3) + blob.rim_covariance_px2(4, 4);
  const double growth = blob.rim_covariance_px2(0, 0) + square(growth_px);
  return variance * Eigen::Matrix2d::Identity() + growth * outward * outward.transpose();
}

}  // namespace occ::internal::core
