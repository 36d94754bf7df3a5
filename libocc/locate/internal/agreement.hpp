// SPDX-License-Identifier: Apache-2.0
// Significance of the inliers of a pose (pose/internal/false_alarms.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/false_alarms.hpp"

namespace occ::internal::locate {

/// Probability model of outliers: uniform in the rectangle of all pixels.
LIBOCC_API pose::FalseAlarmModel chance_anywhere(const Eigen::Matrix2Xd& pixels, double radius_px,
                                                 int sample, int poses);

/// An inlier and its distance from the projected point.
struct Agreement {
  int point = 0;
  double residual_px = 0;
};

struct Significance {
  double log_false_alarms = 0;  ///< natural logarithm; infinite for too few inliers
  double radius_px = 0;         ///< radius that contains all inliers
};

/// ln of the expected number of random poses with these inliers. As in AC-RANSAC (Moisan, Stival,
/// IJCV 57, 2004), the radius within which random points agree follows from the residuals: the
/// radius, of a few, with the fewest false alarms. Residuals of a least-squares fit are scaled up
/// by its degrees of freedom; the smallest radius is sigma_px. In crowded areas a wrong
/// correspondence is often as good as the correct one; inliers that share a radius count once.
LIBOCC_API Significance significance(const Eigen::Matrix2Xd& pixels, std::vector<Agreement> inliers,
                                     double sigma_px, int sample, int poses);

/// True if all inliers but a few lie on a line, and those few are not significant: every rotation
/// about the line fits the others, and the best rotation of random points would gain as many.
/// `sigmas`: sigmas per unit of length across the line; `most`: maximum number of false alarms.
LIBOCC_API bool rests_on_a_line(const Eigen::Matrix3Xd& points, const std::vector<int>& inliers,
                                double sigmas, const pose::FalseAlarmModel& chance, double most);

}  // namespace occ::internal::locate
