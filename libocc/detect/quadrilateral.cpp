// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/quadrilateral.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "libocc/detect/internal/outline.hpp"

namespace occ::internal::detect {
namespace {

// Min share of the hull that bright pixels fill. Two discs that touch fill 0.88 of theirs, a
// rectangle whose long side bends by a quarter of its short side 0.92.
constexpr double min_filled = 0.9;
// Min share of the hull in the largest quadrilateral of its corners: 2 / pi = 0.64 for an ellipse,
// up to 0.71 for two discs that touch or overlap. Blur cuts the corners of a rectangle 12 px wide
// to 0.9, and uneven light makes it a triangle with a cut corner, 0.76.
constexpr double min_spanned = 0.75;
// Level of the outline over the mean level. An unevenly lit lamp has little light somewhere, and a
// lower level moves the outline of an evenly lit one outwards on all sides.
constexpr double outline_level = 0.25;

struct Point {
  std::int64_t x, y;
};

std::int64_t cross(const Point& o, const Point& a, const Point& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

/// Convex hull by the monotone chain (Andrew 1979) of points that are sorted by y, then x.
std::vector<Point> convex_hull(const std::vector<Point>& points) {
  std::vector<Point> hull;
  const auto add = [&](const Point& p, std::size_t keep) {
    while (hull.size() >= keep && cross(hull[hull.size() - 2], hull.back(), p) <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Point& p : points) add(p, 2);
  const std::size_t lower = hull.size() + 1;
  for (auto p = points.rbegin() + 1; p < points.rend(); ++p) add(*p, lower);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

/// Twice the area.
std::int64_t doubled_area(const std::vector<Point>& hull) {
  std::int64_t sum = 0;
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) sum += cross(hull[0], hull[i], hull[i + 1]);
  return sum;
}

/// Number of lattice points in a polygon, by Pick's theorem.
double lattice_points(const std::vector<Point>& hull) {
  std::int64_t border = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point &a = hull[i], &b = hull[(i + 1) % hull.size()];
    border += std::gcd(b.x - a.x, b.y - a.y);
  }
  return 0.5 * static_cast<double>(doubled_area(hull) + border) + 1;
}

/// Twice the area of the largest quadrilateral of corners of the hull: for each diagonal, the
/// farthest corners on both sides.
std::int64_t max_quadrilateral(const std::vector<Point>& hull) {
  std::int64_t best = 0;
  for (std::size_t i = 0; i < hull.size(); ++i)
    for (std::size_t j = i + 2; j < hull.size(); ++j) {
      std::int64_t left = 0, right = 0;
      for (const Point& p : hull) {
        const std::int64_t side = cross(hull[i], hull[j], p);
        left = std::max(left, side);
        right = std::max(right, -side);
      }
      best = std::max(best, left + right);
    }
  return best;
}

}  // namespace

std::optional<Eigen::Vector2d> quadrilateral_centre(const Patch& patch,
                                                    const Component& component) {
  constexpr std::size_t min_corners = 4;
  const double mean = weighted_mean_signal(patch, component);
  if (!(mean > 0)) return std::nullopt;
  const double level = outline_level * mean;
  const int width = component.x1 - component.x0 + 1;
  std::vector<Point> ends;  // of the bright pixels of each row
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
  const std::vector<Point> hull = convex_hull(ends);
  if (hull.size() < min_corners || bright < min_filled * lattice_points(hull)) return std::nullopt;
  const double doubled = static_cast<double>(doubled_area(hull));
  if (static_cast<double>(max_quadrilateral(hull)) < min_spanned * doubled) return std::nullopt;
  Eigen::Vector2d sum_of_centres = Eigen::Vector2d::Zero();
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) {
    const Point &a = hull[0], &b = hull[i], &c = hull[i + 1];
    const Eigen::Vector2d three(static_cast<double>(a.x + b.x + c.x),
                                static_cast<double>(a.y + b.y + c.y));
    sum_of_centres += static_cast<double>(cross(a, b, c)) / 3 * three;
  }
  return Eigen::Vector2d(component.x0, 0) + sum_of_centres / doubled;
}

}  // namespace occ::internal::detect
