// SPDX-License-Identifier: Apache-2.0
// Internal: convex hull of pixels, and the moments of its area.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace occ::internal::detect {

struct Pixel {
  std::int64_t x, y;
};

/// Twice the area of the triangle, positive if it is counter-clockwise (y up).
std::int64_t cross(const Pixel& o, const Pixel& a, const Pixel& b);

/// Convex hull by the monotone chain (Andrew 1979) of pixels that are sorted by y, then x; without
/// points on its sides.
std::vector<Pixel> convex_hull(const std::vector<Pixel>& pixels);

/// Number of pixels in a hull, by Pick's theorem.
double pixels_inside(const std::vector<Pixel>& hull);

/// Largest quadrilateral of a hull's corners, in their order.
struct HullQuadrilateral {
  std::array<Pixel, 4> corners = {};
  double share = 0;  ///< its area over the hull's
};
HullQuadrilateral quadrilateral_of(const std::vector<Pixel>& hull);

/// Centroid and second central moments of the hull's area; the area is positive.
struct AreaMoments {
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second_moments_px2 = Eigen::Matrix2d::Zero();
};
AreaMoments area_moments(const std::vector<Pixel>& hull);

}  // namespace occ::internal::detect
