// SPDX-License-Identifier: Apache-2.0
// Internal: moments of the area inside a closed outline of straight sides.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace occ::internal::core {

struct OutlineMoments {
  double area = 0;  ///< positive for corners from the first axis towards the second
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();  ///< central moments over the area
};

/// Sums over the triangles between the first corner and each side. The centroid is not finite if
/// the area is zero.
inline OutlineMoments outline_moments(const std::vector<Eigen::Vector2d>& corners) {
  double twice_area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d a = corners[i] - corners.front();
    const Eigen::Vector2d b = corners[(i + 1) % corners.size()] - corners.front();
    const double area = a.x() * b.y() - a.y() * b.x();
    twice_area += area;
    first += area * (a + b) / 6;
    const Eigen::Vector2d sum = a + b;
    second += area / 24 * (a * a.transpose() + b * b.transpose() + sum * sum.transpose());
  }
  OutlineMoments moments;
  moments.area = 0.5 * twice_area;
  const Eigen::Vector2d mean = first / moments.area;
  moments.centroid = corners.front() + mean;
  moments.second = second / moments.area - mean * mean.transpose();
  return moments;
}

}  // namespace occ::internal::core
