// SPDX-License-Identifier: Apache-2.0
// Layout of points about their centroid (line, plane or space), and the choice of few points among
// many that determine a pose well. Points are columns.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

struct PointLayout {
  Eigen::Vector3d centroid;
  Eigen::Matrix3d axes;    ///< principal axes in columns, widest first, right-handed
  Eigen::Vector3d extent;  ///< root of the sum of squares along each axis
};

LIBOCC_API PointLayout point_layout(const Eigen::Matrix3Xd& points);

/// True if the extent across the best line, or across the best plane, exceeds rounding.
LIBOCC_API bool spans_plane(const PointLayout& layout);
LIBOCC_API bool spans_space(const PointLayout& layout);

using Triple = std::array<int, 3>;  ///< indices of points

/// A triple of large area: an end of the points' longest extent, the point farthest from it, and
/// the point farthest from the line through both.
LIBOCC_API Triple spread_triple(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

/// Triples to try in this order: all four of four points; otherwise the triples of large area of
/// the points, of the bearings, and of the points outside the first triple.
LIBOCC_API std::vector<Triple> triples_to_try(const Eigen::Matrix3Xd& points,
                                              const Eigen::Matrix3Xd& bearings);

/// True if the points are on a line to rounding. `chosen`: a triple of large area; `offset`:
/// distance of the points from the world's origin, in their unit, where the coordinates were
/// rounded.
LIBOCC_API bool on_a_line(const Eigen::Matrix3Xd& points, const Triple& chosen, double offset);

/// Root of the sum of the points' squared distances from their best line.
LIBOCC_API double height_over_line(const Eigen::Matrix3Xd& points);

/// The rotation about the points' best line is determined by their distances from it. If these are
/// observed with fewer sigmas than this limit, the standard deviation of the rotation exceeds a
/// quarter of a radian, and a covariance no longer describes the pose.
inline constexpr double min_seen_height = 4;

}  // namespace occ::internal::pose
