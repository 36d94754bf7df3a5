// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/quadrilateral.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/pixel_hull.hpp"

namespace occ::internal::detect {
namespace {

// Min share of the hull that bright pixels fill. Two discs that touch fill 0.88 of theirs, a
// rectangle whose long side bends by a quarter of its short side 0.92.
constexpr double min_filled = 0.9;
// Min share of the hull in the largest quadrilateral of its corners: 2 / pi = 0.64 for an ellipse,
// up to 0.71 for two discs that touch or overlap. Blur cuts the corners of a rectangle 12 px wide
// to 0.9, and uneven light makes it a triangle with a cut corner, 0.76.
constexpr double min_spanned = 0.75;

}  // namespace

std::optional<Eigen::Vector2d> quadrilateral_centre(const Patch& patch,
                                                    const Component& component) {
  constexpr std::size_t min_corners = 4;
  const double mean = weighted_mean_signal(patch, component);
  if (!(mean > 0)) return std::nullopt;
  const double level = outline_level * mean;
  const int width = component.x1 - component.x0 + 1;
  std::vector<Pixel> ends;  // of the bright pixels of each row
  double bright = 0;
  for (int y = component.y0; y <= component.y1; ++y) {
    const float* row = patch.at(component.x0, y);
    int first = width, last = -1;
    for (int x = 0; x < width; ++x) {
      if (!(row[x] > level)) continue;
      ++bright;
      first = std::min(first, x);
      last = x;
    }
    if (last < 0) continue;
    ends.push_back({first, y});
    if (last > first) ends.push_back({last, y});
  }
  if (ends.size() < min_corners) return std::nullopt;
  const std::vector<Pixel> hull = convex_hull(ends);
  if (hull.size() < min_corners || bright < min_filled * pixels_inside(hull)) return std::nullopt;
  if (share_of_quadrilateral(hull) < min_spanned) return std::nullopt;
  return Eigen::Vector2d(component.x0, 0) + area_moments(hull).centroid_px;
}

}  // namespace occ::internal::detect
