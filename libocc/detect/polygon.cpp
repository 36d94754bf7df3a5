// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/polygon.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/normal_table.hpp"
#include "libocc/detect/internal/plateau.hpp"
#include "libocc/detect/internal/region.hpp"

namespace occ::internal::detect {
namespace {

constexpr std::size_t max_sides = 8;   // an octagon; a disc of a few pixels needs as many
constexpr double corner_px = 0.75;     // max distance of an outline's points from a side, which
                                       // exceeds the rounding of a corner by usual blur
constexpr double rough_side_px = 0.3;  // max scatter of a side's crossings, as for ellipses
constexpr double max_sagitta = 0.03, max_sagitta_px = 0.15;  // bend of a side by distortion: part
                                                             // of its length, and crossings' noise
constexpr double min_side_px = 2.5;                          // shorter sides are rounded corners
constexpr double bent_px = 16;                               // shorter sides are straight
constexpr double same_direction = 0.1;  // sine between two sides that have no corner [rad]

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Adds the crossings between two corners that are farther than corner_px from the line between the
/// corners around them, in order. False if there are too many.
bool split(const std::vector<RegionCrossing>& outline, std::size_t from, std::size_t to,
           std::vector<std::size_t>& corners) {
  const std::size_t n = outline.size();
  const Eigen::Vector2d start = outline[from % n].px;
  const Eigen::Vector2d along = (outline[to % n].px - start).normalized();
  double farthest = corner_px;
  std::size_t corner = 0;
  for (std::size_t i = from + 1; i < to; ++i) {
    const double distance = std::abs(cross(along, outline[i % n].px - start));
    if (distance > farthest) farthest = distance, corner = i;
  }
  if (corner == 0) return true;
  if (corners.size() >= 2 * max_sides) return false;
  if (!split(outline, from, corner, corners)) return false;
  corners.push_back(corner);
  return split(outline, corner, to, corners);
}

std::size_t farthest_from(const std::vector<RegionCrossing>& outline, const Eigen::Vector2d& px) {
  std::size_t farthest = 0;
  for (std::size_t i = 1; i < outline.size(); ++i)
    if ((outline[i].px - px).squaredNorm() > (outline[farthest].px - px).squaredNorm())
      farthest = i;
  return farthest;
}

/// Removes corners that are hardly farther from the line between their neighbours than the
/// outline's points are: the two that the splits start with need not be corners.
void remove_straight(const std::vector<RegionCrossing>& outline,
                     std::vector<std::size_t>& corners) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < corners.size() && corners.size() > 3;) {
    const std::size_t count = corners.size();
    const Eigen::Vector2d before = outline[corners[(i + count - 1) % count] % n].px;
    const Eigen::Vector2d along = outline[corners[(i + 1) % count] % n].px - before;
    if (std::abs(cross(along.normalized(), outline[corners[i] % n].px - before)) < corner_px) {
      corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(i));
      i = 0;
    } else {
      ++i;
    }
  }
}

/// Indices of the corners, ascending from the first one, which may exceed the number of crossings.
std::vector<std::size_t> corners_of(const std::vector<RegionCrossing>& outline) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const RegionCrossing& c : outline) mean += c.px / static_cast<double>(outline.size());
  const std::size_t first = farthest_from(outline, mean);
  std::size_t second = farthest_from(outline, outline[first].px);
  if (second < first) second += outline.size();
  std::vector<std::size_t> corners{first};
  if (!split(outline, first, second, corners)) return {};
  corners.push_back(second);
  if (!split(outline, second, first + outline.size(), corners)) return {};
  remove_straight(outline, corners);
  return corners;
}

/// Least-squares line or parabola through points of a side; the first has the direction of the line
/// between `from` and `to`.
PolygonSide side_between(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  PolygonSide side;
  side.column = std::abs(along.x()) >= std::abs(along.y());
  const int u = side.column ? 0 : 1, v = 1 - u;
  side.middle = 0.5 * (from[u] + to[u]);
  side.by_u << 0.5 * (from[v] + to[v]), along[v] / along[u], 0;
  // Clockwise with y down, the inside is to the right: outward is (along.y, -along.x).
  side.outward = side.column ? (along.x() > 0 ? -1 : 1) : (along.y() > 0 ? 1 : -1);
  return side;
}

/// True if a side is about parallel to another one, with its outside on the other hand.
bool faces(const Polygon& polygon, std::size_t side, std::size_t other) {
  constexpr double max_cosine = -0.7;
  return polygon.normal(side).dot(polygon.normal(other)) < max_cosine;
}

}  // namespace

Polygon Polygon::through(std::vector<Eigen::Vector2d> corners_px) {
  Polygon polygon;
  polygon.corners_px = std::move(corners_px);
  for (std::size_t i = 0; i < polygon.corners_px.size(); ++i)
    polygon.sides.push_back(side_between(polygon.corners_px[i], polygon.corner_after(i)));
  return polygon;
}

Eigen::Vector2d Polygon::normal(std::size_t side) const {
  const Eigen::Vector2d along = corner_after(side) - corners_px[side];
  return Eigen::Vector2d(along.y(), -along.x()).normalized();
}

double Polygon::coverage(const Eigen::Vector2d& px, double blur_px) const {
  const NormalTable& table = NormalTable::get();
  double share = 1;
  for (std::size_t i = 0; i < sides.size(); ++i)
    share *= table(normal(i).dot(corners_px[i] - px) / blur_px).below;
  return share;
}

AdjacentSides::AdjacentSides(const Polygon& polygon, const RimLine& line, std::size_t side,
                             double blur_px)
    : edge_(line.edge) {
  constexpr double clear_sigmas = 3.5;  // a side at this distance leaves all light
  const double half_window = window_sigmas * blur_px / line.cosine();
  const Eigen::Vector2d px = line.point(line.edge);
  for (std::size_t i = 0; i < polygon.sides.size(); ++i) {
    if (i == side || faces(polygon, i, side)) continue;
    const Eigen::Vector2d normal = polygon.normal(i);
    const Distance d{normal.dot(polygon.corners_px[i] - px) / blur_px,
                     -normal[line.column ? 1 : 0] / blur_px, normal.dot(polygon.normal(side))};
    if (d.at_edge - half_window * std::abs(d.by_along) < clear_sigmas) distances_.push_back(d);
  }
}

EdgeShare AdjacentSides::operator()(double along) const {
  const NormalTable& table = NormalTable::get();
  EdgeShare out;
  for (const Distance& d : distances_) {
    const NormalTable::Value at = table(d.at_edge + d.by_along * (along - edge_));
    out.mixed = out.mixed * at.below + out.share * d.cosine * at.density;
    out.share *= at.below;
  }
  return out;
}

std::vector<RimLine> Polygon::lines(std::size_t side, double margin_px) const {
  std::vector<RimLine> out;
  const PolygonSide& s = sides[side];
  const double cosine = 1 / std::sqrt(1 + square(s.slope(s.middle)));
  const double from = s.u_of(corners_px[side]), to = s.u_of(corner_after(side));
  const double margin = margin_px * cosine;
  const int first = static_cast<int>(std::ceil(std::min(from, to) + margin));
  const int last = static_cast<int>(std::floor(std::max(from, to) - margin));
  const int v_axis = s.column ? 1 : 0;
  for (int u = first; u <= last; ++u) {
    const Eigen::Vector2d at = s.point(u);
    Eigen::Vector2d inward = Eigen::Vector2d::Zero();
    inward[v_axis] = -s.outward;
    double chord = infinity;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const double rate = normal(i).dot(inward);
      if (faces(*this, i, side) && rate > 0)
        chord = std::min(chord, normal(i).dot(corners_px[i] - at) / rate);
    }
    const double edge = s.edge(u);
    out.push_back(
        {s.column, u, edge, edge - s.outward * chord, s.outward, s.slope(u), 2 * s.by_u[2]});
  }
  return out;
}

void Polygon::fit_side(std::size_t side, const std::vector<RimPoint>& points) {
  PolygonSide& s = sides[side];
  const int v_axis = s.column ? 1 : 0;
  const double length = (corner_after(side) - corners_px[side]).norm();
  const int unknowns = points.size() >= 8 && length > bent_px ? 3 : points.size() >= 3 ? 2 : 1;
  if (points.empty()) return;
  const double scale = 2 / length;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const RimPoint& point : points) {
    const double u = s.u_of(point.px), t = scale * (u - s.middle);
    const Eigen::Vector3d row(1, t, t * t);
    const double weight = 1 / square(point.sigma_px);
    normal += weight * row * row.transpose();
    right += weight * (point.px[v_axis] - s.edge(u)) * row;
  }
  for (int i = unknowns; i < 3; ++i)
    normal.row(i).setZero(), normal.col(i).setZero(), normal(i, i) = 1, right[i] = 0;
  const Eigen::Vector3d change = core::solve_ldlt(normal, right);
  if (!change.allFinite()) return;
  s.by_u += Eigen::Vector3d(change[0], scale * change[1], square(scale) * change[2]);
}

bool Polygon::update() {
  const std::size_t n = sides.size();
  std::vector<Eigen::Vector2d> corners(n);
  for (std::size_t i = 0; i < n; ++i) {
    const PolygonSide &a = sides[(i + n - 1) % n], &b = sides[i];
    Eigen::Vector2d px = corners_px[i];
    for (int step = 0; step < 4; ++step) {  // Newton's method; both sides are almost straight
      const auto row = [&](const PolygonSide& s) {
        const double slope = s.slope(s.u_of(px));
        return s.column ? Eigen::RowVector2d(-slope, 1) : Eigen::RowVector2d(1, -slope);
      };
      const auto off = [&](const PolygonSide& s) {
        return s.edge(s.u_of(px)) - (s.column ? px.y() : px.x());
      };
      Eigen::Matrix2d matrix;
      matrix << row(a), row(b);
      if (std::abs(matrix.determinant()) < same_direction) {
        // No corner, but two parts of one bent side.
        px = 0.5 * (a.point(a.u_of(px)) + b.point(b.u_of(px)));
        break;
      }
      px += matrix.inverse() * Eigen::Vector2d(off(a), off(b));
    }
    if (!px.allFinite() || (px - corners_px[i]).norm() > 5) return false;
    corners[i] = px;
  }
  corners_px = corners;
  const Eigen::Vector2d origin = corners_px.front();
  double twice_area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d a = corners_px[i] - origin, b = corner_after(i) - origin;
    const Eigen::Vector2d next = corner_after((i + 1) % n) - origin;
    if (!(cross(b - a, next - b) > -same_direction * (b - a).norm() * (next - b).norm()))
      return false;
    const double area = cross(a, b);
    twice_area += area;
    first += area * (a + b) / 6;
    const Eigen::Vector2d sum = a + b;
    second += area / 24 * (a * a.transpose() + b * b.transpose() + sum * sum.transpose());
    // Area between a bent side and its chord.
    const PolygonSide& s = sides[i];
    const double run = std::abs(s.u_of(b) - s.u_of(a));
    const double lens = -s.outward * s.by_u[2] * run * run * run / 6;
    twice_area += 2 * lens;
    first += lens * (a + b) / 2;
    second += lens * (a + b) * (a + b).transpose() / 4;
  }
  area_px2 = 0.5 * twice_area;
  if (!(area_px2 > 0)) return false;
  const Eigen::Vector2d centre = first / area_px2;
  centroid_px = origin + centre;
  second_moments_px2 = second / area_px2 - centre * centre.transpose();
  return true;
}

namespace {

/// Removes a side from the polygon; `starts`: index of the crossing where each side starts.
void remove_side(std::size_t side, Polygon& polygon, std::vector<std::size_t>& starts) {
  const auto at = static_cast<std::ptrdiff_t>(side);
  polygon.sides.erase(polygon.sides.begin() + at);
  polygon.corners_px.erase(polygon.corners_px.begin() + at);
  starts.erase(starts.begin() + at);
}

/// Joins sides that have the same direction but for noise and the distortion of a lens.
void join_straight_sides(Polygon& polygon, std::vector<std::size_t>& starts) {
  for (std::size_t i = 0; i < polygon.sides.size() && polygon.sides.size() > 3;) {
    const std::size_t n = polygon.sides.size(), before = (i + n - 1) % n;
    const Eigen::Vector2d from = polygon.corners_px[before], to = polygon.corner_after(i);
    const Eigen::Vector2d along = to - from;
    const double bend_px = std::abs(cross(along.normalized(), polygon.corners_px[i] - from));
    if (std::abs(cross(polygon.normal(before), polygon.normal(i))) > same_direction ||
        bend_px > max_sagitta * along.norm() + corner_px) {
      ++i;
      continue;
    }
    polygon.sides[before] = side_between(from, to);
    remove_side(i, polygon, starts);
    i = 0;
  }
}

/// Returns the point where the neighbours of a short side meet if that is close to it: blur or
/// noise has rounded the corner.
std::optional<Eigen::Vector2d> rounded_corner(const Polygon& polygon, std::size_t side) {
  constexpr double short_px = 10, near_px = 1;  // beyond half of its length
  const std::size_t n = polygon.sides.size(), before = (side + n - 1) % n, after = (side + 1) % n;
  const Eigen::Vector2d from = polygon.corners_px[side], to = polygon.corner_after(side);
  const double length = (to - from).norm();
  if (length > short_px) return std::nullopt;
  Eigen::Matrix2d normals;
  normals << polygon.normal(before).transpose(), polygon.normal(after).transpose();
  const Eigen::Vector2d offsets(polygon.normal(before).dot(polygon.corners_px[before]),
                                polygon.normal(after).dot(polygon.corner_after(after)));
  const Eigen::Vector2d meet = normals.inverse() * offsets;
  if (!((meet - 0.5 * (from + to)).norm() < 0.5 * length + near_px)) return std::nullopt;
  return meet;
}

/// Removes rounded corners, the shortest first. Beyond the image border, sides do not meet.
void remove_rounded_corners(const Patch& patch, Polygon& polygon,
                            std::vector<std::size_t>& starts) {
  while (polygon.sides.size() > 3) {
    double shortest = infinity;
    std::size_t side = 0;
    Eigen::Vector2d corner = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < polygon.sides.size(); ++i) {
      const double length = (polygon.corner_after(i) - polygon.corners_px[i]).norm();
      if (!(length < shortest)) continue;
      const std::optional<Eigen::Vector2d> meet = rounded_corner(polygon, i);
      if (!meet || !patch.contains(static_cast<int>(std::lround(meet->x())),
                                   static_cast<int>(std::lround(meet->y()))))
        continue;
      shortest = length;
      side = i;
      corner = *meet;
    }
    if (std::isinf(shortest)) return;
    polygon.corners_px[(side + 1) % polygon.sides.size()] = corner;
    remove_side(side, polygon, starts);
  }
}

/// Fits the sides to the crossings between their corners. The first corners are rough, so only the
/// inner part of each side is used then. False if they are not straight.
bool fit_sides(const std::vector<RegionCrossing>& outline, const std::vector<std::size_t>& starts,
               double corner_margin_px, bool rough, Polygon& polygon) {
  constexpr double rough_part = 0.25, max_rough_px = 6, short_side_px = 12;
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < starts.size(); ++i) {
    std::size_t end = starts[(i + 1) % starts.size()];
    if (end <= starts[i]) end += n;
    const Eigen::Vector2d from = polygon.corners_px[i], to = polygon.corner_after(i);
    const double length = (to - from).norm();
    const double margin_px = rough ? std::min(rough_part * length, max_rough_px) : corner_margin_px;
    std::vector<RimPoint> points;
    for (std::size_t k = starts[i]; k <= end; ++k) {
      const RegionCrossing& c = outline[k % n];
      const double at = (c.px - from).dot(to - from) / length;
      if (c.column == polygon.sides[i].column && at > margin_px && at < length - margin_px)
        points.push_back({c.px, polygon.normal(i), 1});
    }
    polygon.fit_side(i, points);
    // The few points of a short side may belong to the corners; its profiles decide later.
    if (rough || length < short_side_px) continue;
    const PolygonSide& s = polygon.sides[i];
    double squares = 0;
    for (const RimPoint& p : points)
      squares += square(p.px[s.column ? 1 : 0] - s.edge(s.u_of(p.px)));
    const double run = std::abs(s.u_of(to) - s.u_of(from));
    if (squares > square(rough_side_px) * static_cast<double>(points.size()) ||
        std::abs(s.by_u[2]) * square(run) / 4 > max_sagitta * length + max_sagitta_px)
      return false;
  }
  return polygon.update();
}

}  // namespace

std::optional<Polygon> find_polygon(const Patch& patch, const Component& component, double level,
                                    double blur_px) {
  const Region region(patch, component, level);
  if (region.area_px() < component.area_px / 4) return std::nullopt;
  const std::vector<RegionCrossing> outline = region.crossings();
  if (outline.size() < 8) return std::nullopt;
  std::vector<std::size_t> corners = corners_of(outline);
  const std::size_t n = outline.size();
  if (corners.size() < 3) return std::nullopt;

  std::vector<Eigen::Vector2d> first;
  for (const std::size_t corner : corners) first.push_back(outline[corner % n].px);
  Polygon polygon = Polygon::through(std::move(first));
  constexpr int passes = 3;  // corners move by a few pixels in the first two
  for (int pass = 0; pass < passes; ++pass) {
    join_straight_sides(polygon, corners);
    remove_rounded_corners(patch, polygon, corners);
    if (corners.size() > max_sides ||
        !fit_sides(outline, corners, 1.5 * blur_px, pass == 0, polygon))
      return std::nullopt;
  }
  constexpr double area_error = 0.02, edge_error_px = 0.2;
  constexpr double min_cut_px = 8;  // radius of the inscribed circle of a lamp that the border cuts
  if (component.touches_border && 2 * polygon.area_px2 < min_cut_px * polygon.perimeter_px())
    return std::nullopt;
  if (std::abs(polygon.area_px2 - region.area_px()) >
      area_error * polygon.area_px2 + edge_error_px * polygon.perimeter_px())
    return std::nullopt;
  return polygon;
}

}  // namespace occ::internal::detect
