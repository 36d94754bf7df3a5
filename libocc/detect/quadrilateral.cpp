// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/quadrilateral.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "libocc/core/math.hpp"
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

constexpr double min_spanned_by_sides = 0.85;  // where all four sides are to be measured

/// Convex hull of the pixels above a share of the component's level; empty if they do not fill it.
std::vector<Pixel> bright_hull(const Patch& patch, const Component& component) {
  constexpr std::size_t min_corners = 4;
  const double mean = weighted_mean_signal(patch, component);
  if (!(mean > 0)) return {};
  const double level = outline_level * mean;
  std::vector<Pixel> ends;  // of the bright pixels of each row
  double bright = 0;
  for (int y = component.y0; y <= component.y1; ++y) {
    const float* row = patch.at(component.x0, y);
    int first = component.x1 + 1, last = component.x0 - 1;
    for (int x = component.x0; x <= component.x1; ++x) {
      if (!(row[x - component.x0] > level)) continue;
      ++bright;
      first = std::min(first, x);
      last = x;
    }
    if (last < first) continue;
    ends.push_back({first, y});
    if (last > first) ends.push_back({last, y});
  }
  if (ends.size() < min_corners) return {};
  std::vector<Pixel> hull = convex_hull(ends);
  if (hull.size() < min_corners || bright < min_filled * pixels_inside(hull)) return {};
  return hull;
}

/// Coordinate along a line across a side at which the light falls to half of that inside; empty if
/// it does not.
std::optional<double> half_level(const Patch& patch, const RimLine& line) {
  constexpr double nearest_px = 2, farthest_px = 5;  // light inside, beyond the blur of the side
  constexpr double reach_px = 4;                     // of the search outwards
  const double middle_px = 0.5 * std::abs(line.edge - line.opposite);
  const double last_px = std::min(farthest_px, middle_px), first_px = std::min(nearest_px, last_px);
  const auto at = [&](double outwards_px) -> std::optional<double> {
    const double along = line.edge + line.outward * outwards_px;
    const int low = static_cast<int>(std::floor(along));
    if (!line.inside(patch, low, low + 1)) return std::nullopt;
    const double part = along - low;
    return (1 - part) * *line.pixel(patch, low) + part * *line.pixel(patch, low + 1);
  };
  double sum = 0;
  int count = 0;
  for (double depth = first_px; depth <= last_px; ++depth, ++count) sum += at(-depth).value_or(0);
  const double level = 0.5 * sum / count;
  if (!(level > 0)) return std::nullopt;
  double before = 2 * level;
  for (double outwards = -first_px; outwards <= reach_px; ++outwards) {
    const std::optional<double> here = at(outwards);
    if (!here) return std::nullopt;
    if (*here < level) {
      const double back = before > level ? (level - *here) / (before - *here) : 0;
      return line.edge + line.outward * (outwards - back);
    }
    before = *here;
  }
  return std::nullopt;
}

/// Replaces a side by the line through points.
void fit_line(const std::vector<RimPoint>& points, PolygonSide& side) {
  double n = 0, u = 0, v = 0, uu = 0, uv = 0;
  for (const RimPoint& point : points) {
    const double at = side.u_of(point.px) - side.middle, edge = point.px[side.column ? 1 : 0];
    ++n, u += at, v += edge, uu += at * at, uv += at * edge;
  }
  const double slope = (uv - u * v / n) / (uu - u * u / n);
  side.by_u << (v - slope * u) / n, slope, 0;
}

/// Distance outwards of the points in the middle half of a side from those at its ends.
double bulge_px(const std::vector<RimPoint>& points, const PolygonSide& side) {
  struct Mean {
    double sum = 0, count = 0;
  } middle, ends;
  for (std::size_t k = 0; k < points.size(); ++k) {
    Mean& part = 4 * k < points.size() || 4 * k >= 3 * points.size() ? ends : middle;
    part.sum += points[k].px[side.column ? 1 : 0] - side.edge(side.u_of(points[k].px));
    ++part.count;
  }
  return side.outward * (middle.sum / middle.count - ends.sum / ends.count);
}

/// Fits a straight side to where the light falls. Returns its points, none if they are not on a
/// line, and their scatter.
std::vector<RimPoint> measure_side(const Patch& patch, std::size_t side, Polygon& polygon,
                                   double& rms_px) {
  constexpr double corner_px = 2, corner_share = 0.1, far_px = 1.5, max_rms_px = 0.7;
  constexpr double min_used = 0.7;
  constexpr double max_bulge_px = 0.25, max_bulge = 0.01;  // with that part of its length
  constexpr std::size_t min_points = 4;
  const double length = (polygon.corner_after(side) - polygon.corners_px[side]).norm();
  std::vector<RimPoint> points;
  std::size_t lines = 0;
  for (const RimLine& line : polygon.lines(side, std::max(corner_px, corner_share * length))) {
    ++lines;
    if (const auto edge = half_level(patch, line))
      points.push_back({line.point(*edge), polygon.normal(side), 1});
  }
  PolygonSide& s = polygon.sides[side];
  const auto off = [&](const RimPoint& p) { return p.px[s.column ? 1 : 0] - s.edge(s.u_of(p.px)); };
  for (int pass = 0; pass < 2; ++pass) {
    if (points.size() < min_points) return {};
    fit_line(points, s);
    points.erase(std::remove_if(points.begin(), points.end(),
                                [&](const RimPoint& p) { return std::abs(off(p)) > far_px; }),
                 points.end());
  }
  double squares = 0;
  for (const RimPoint& point : points) squares += square(off(point));
  rms_px = std::sqrt(squares / static_cast<double>(points.size()));
  const auto used = static_cast<double>(points.size()), all = static_cast<double>(lines);
  if (points.size() < min_points || used < min_used * all || rms_px > max_rms_px ||
      bulge_px(points, s) > max_bulge_px + max_bulge * length)
    return {};
  return points;
}

}  // namespace

std::optional<Eigen::Vector2d> quadrilateral_centre(const Patch& patch,
                                                    const Component& component) {
  const std::vector<Pixel> hull = bright_hull(patch, component);
  if (hull.empty() || quadrilateral_of(hull).share < min_spanned) return std::nullopt;
  return area_moments(hull).centroid_px;
}

std::optional<PolygonRim> measure_quadrilateral(const Patch& patch, const Component& component) {
  constexpr double min_side_px = 5, min_area_px2 = 250;  // smaller ones may be noisy discs
  constexpr double growth_px = 1, stretch_px = 0.5, shift_px = 0.2;
  constexpr double min_error_px = 0.4;  // of a side: its points err alike
  constexpr int passes = 3;
  if (component.area_px < min_area_px2 / 2) return std::nullopt;  // most blobs are spots
  const std::vector<Pixel> hull = bright_hull(patch, component);
  if (hull.empty()) return std::nullopt;
  const HullQuadrilateral rough = quadrilateral_of(hull);
  if (rough.share < min_spanned_by_sides) return std::nullopt;
  std::vector<Eigen::Vector2d> corners;
  for (const Pixel& p : rough.corners)
    corners.emplace_back(static_cast<double>(p.x), static_cast<double>(p.y));
  PolygonRim rim;
  rim.polygon = Polygon::through(corners);
  std::array<std::vector<RimPoint>, 4> points;
  double error_px = min_error_px;
  for (int pass = 0; pass < passes; ++pass) {
    error_px = min_error_px;
    for (std::size_t i = 0; i < points.size(); ++i) {
      double rms_px = 0;
      points[i] = measure_side(patch, i, rim.polygon, rms_px);
      if (points[i].empty()) return std::nullopt;
      error_px = std::max(error_px, rms_px);
    }
    if (!rim.polygon.update()) return std::nullopt;
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d along = rim.polygon.corner_after(i) - rim.polygon.corners_px[i];
    if (along.norm() < min_side_px) return std::nullopt;
    for (RimPoint point : points[i]) {
      point.normal = rim.polygon.normal(i);
      point.sigma_px = error_px * std::sqrt(static_cast<double>(points[i].size()));
      rim.points.push_back(point);
    }
  }
  if (rim.polygon.area_px2 < min_area_px2) return std::nullopt;
  rim.common_covariance_px2.diagonal() << square(growth_px), square(shift_px), square(shift_px),
      square(stretch_px), square(stretch_px);
  rim.centre_covariance_px2 =
      (square(error_px) / 2 + square(shift_px)) * Eigen::Matrix2d::Identity();
  return rim;
}

}  // namespace occ::internal::detect
