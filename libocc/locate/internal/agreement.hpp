// SPDX-License-Identifier: Apache-2.0
// Significance of the inliers of a pose (pose/internal/false_alarms.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/false_alarms.hpp"

namespace occ::internal::locate {

/// Probability model of outliers: uniform in the rectangle of all pixels.
pose::FalseAlarmModel chance_anywhere(const Eigen::Matrix2Xd& pixels, double gate_px, int sample,
                                      int poses);

/// ln of the expected number of random poses with these inliers. In crowded areas a wrong
/// correspondence is often as good as the correct one; inliers that share a gate count once.
double log_false_alarms(pose::FalseAlarmModel chance, const Eigen::Matrix2Xd& pixels,
                        double gate_px, const std::vector<int>& inliers);

/// True if all inliers but a few lie on a line, and those few are not significant: every rotation
/// about the line fits the others, and the best rotation of random points would gain as many.
/// `sigmas`: sigmas per unit of length across the line; `most`: maximum number of false alarms.
bool rests_on_a_line(const Eigen::Matrix3Xd& points, const std::vector<int>& inliers, double sigmas,
                     const pose::FalseAlarmModel& chance, double most);

}  // namespace occ::internal::locate
