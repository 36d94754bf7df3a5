// SPDX-License-Identifier: Apache-2.0
// Internal: which few of many points determine a pose well.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

using Triple = std::array<int, 3>;

/// A triple of large area: an end of the points' longest extent, the point furthest from it, and
/// the one furthest from the line through both. Columns are points.
Triple spread_triple(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

/// Whether the points, `chosen` being a triple of large area, are on a line but for rounding: of
/// arithmetic, or of coordinates as far from the world's origin as `offset` (points' unit).
bool on_a_line(const Eigen::Matrix3Xd& points, const Triple& chosen, double offset);

/// A turn about the line that fits points best rests on how far they are off it. Seen by fewer
/// sigmas than this, the turn is known to a quarter of a radian at best, and no covariance
/// describes the pose.
inline constexpr double min_seen_height = 4;

/// Root of the sum of the points' squared distances from the line that fits them best.
double height_over_line(const Eigen::Matrix3Xd& points);

/// Triples to try, the best first: all four of four points; otherwise the spread ones of the points
/// and of the bearings, and of those points that are left.
std::vector<Triple> triples_to_try(const Eigen::Matrix3Xd& points,
                                   const Eigen::Matrix3Xd& bearings);

}  // namespace occ::internal::pose
