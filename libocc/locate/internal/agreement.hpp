// SPDX-License-Identifier: Apache-2.0
// Internal: whether points that agree with a pose mean anything (pose/internal/false_alarms.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/false_alarms.hpp"

namespace occ::internal::locate {

/// Pixels that wrong matches take: anywhere in the rectangle that all span.
pose::FalseAlarmModel chance_anywhere(const Eigen::Matrix2Xd& pixels, double gate_px, int sample,
                                      int poses);

/// ln of the number of poses by chance that `inliers` agree with. Where pixels are crowded a wrong
/// match is often as good as the right one, and those that share a gate count as one.
double log_false_alarms(pose::FalseAlarmModel chance, const Eigen::Matrix2Xd& pixels,
                        double gate_px, const std::vector<int>& inliers);

/// Whether all but a few inliers are on a line, so that any turn about it fits them, and those few
/// are no more than chance would bring at the best of all turns. `sigmas`: by how many a unit of
/// length across the line is seen, `most`: false alarms.
bool rests_on_a_line(const Eigen::Matrix3Xd& points, const std::vector<int>& inliers, double sigmas,
                     const pose::FalseAlarmModel& chance, double most);

}  // namespace occ::internal::locate
