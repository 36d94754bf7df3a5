// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/free_outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libocc/core/internal/area_moments.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/flood.hpp"
#include "libocc/detect/internal/pixel_hull.hpp"

namespace occ::internal::detect {
namespace {

constexpr double free_corner_sigmas = 2.5;  // points closer to a corner are not used [blur sigma]
// Curvature of a corner, in units of 1 / sigma of the blur: the shift of an evenly bent edge by its
// blur is known to second order in it.
constexpr double corner_curvature = 0.25;
constexpr double narrow_sigmas = 2, wide_sigmas = 4;  // reach of a parabola, for corners and points
constexpr double min_reach_px = 2.5;
constexpr std::size_t min_points = 5;  // of a parabola

// Directions of the neighbours of a pixel: up, right, down, left.
constexpr std::array<std::pair<int, int>, 4> border_steps = {{{0, -1}, {1, 0}, {0, 1}, {-1, 0}}};

std::pair<int, int> brightest_pixel(const Patch& patch, const Component& component) {
  std::pair<int, int> best{component.x0, component.y0};
  for (int y = component.y0; y <= component.y1; ++y)
    for (int x = component.x0; x <= component.x1; ++x)
      if (*patch.at(x, y) > *patch.at(best.first, best.second)) best = {x, y};
  return best;
}

/// Share of its convex hull that an outline fills.
double filled_share(const std::vector<Eigen::Vector2d>& outline, double area_px2) {
  constexpr double scale = 16;  // the hull is one of whole numbers
  std::vector<Pixel> pixels;
  for (const Eigen::Vector2d& px : outline)
    pixels.push_back({std::lround(scale * px.x()), std::lround(scale * px.y())});
  std::sort(pixels.begin(), pixels.end(),
            [](const Pixel& a, const Pixel& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; });
  std::vector<Eigen::Vector2d> hull;
  for (const Pixel& p : convex_hull(pixels))
    hull.emplace_back(static_cast<double>(p.x) / scale, static_cast<double>(p.y) / scale);
  return area_px2 / core::outline_moments(hull).area;
}

/// Distance from a pixel above a level to the level, towards a pixel below it.
double part_above(const Patch& patch, double level, int x, int y, int dx, int dy) {
  const double inside = *patch.at(x, y), outside = *patch.at(x + dx, y + dy);
  return (inside - level) / (inside - outside);
}

}  // namespace

std::optional<FreeOutline> FreeOutline::trace(const Patch& patch, const Component& component,
                                              double level, double blur_px) {
  const auto start = brightest_pixel(patch, component);
  const auto is_above = [&](int x, int y) {
    return patch.contains(x, y) && *patch.at(x, y) > level;
  };
  if (!is_above(start.first, start.second)) return std::nullopt;
  const auto pixels = static_cast<std::size_t>(patch.width()) * patch.height();
  FreeOutline outline(patch, std::vector<char>(pixels, 0));
  outline.inside_[outline.at(start.first, start.second)] = 1;
  const auto take = [&](int x, int y) {
    if (!is_above(x, y) || outline.inside_[outline.at(x, y)]) return false;
    outline.inside_[outline.at(x, y)] = 1;
    return true;
  };
  const std::size_t area = flood(start, side_steps, take).size();
  if (area < static_cast<std::size_t>(component.area_px) / 4) return std::nullopt;
  outline.follow(patch, level);
  std::vector<Eigen::Vector2d> border;
  for (const Crossing& c : outline.crossings_) border.push_back(c.px);
  outline.measure_area(border);
  if (outline.crossings_.size() < 2 * min_points || !(outline.area_px2_ > 0)) return std::nullopt;
  outline.leave_out_corners(blur_px);
  outline.fit_parabolas(blur_px);
  return outline;
}

/// The crossing between a pixel of the region and its neighbour outside. It is not usable at the
/// border of the patch.
FreeOutline::Crossing FreeOutline::crossing(const Patch& patch, double level, int x, int y,
                                            int direction) const {
  const auto [dx, dy] = border_steps[static_cast<std::size_t>(direction)];
  Crossing out;
  out.line.column = dx == 0;
  out.line.index = dx == 0 ? x : y;
  out.line.outward = dx + dy;
  out.px = Eigen::Vector2d(x, y);
  if (!patch.contains(x + dx, y + dy)) {
    out.usable = false;
  } else {
    out.px += part_above(patch, level, x, y, dx, dy) * Eigen::Vector2d(dx, dy);
  }
  // The far edge on the same row or column.
  int back = 0;
  while (contains(patch, x - (back + 1) * dx, y - (back + 1) * dy)) ++back;
  const int far_x = x - back * dx, far_y = y - back * dy;
  out.line.opposite = dx == 0 ? far_y : far_x;
  out.line.opposite -= out.line.outward * (patch.contains(far_x - dx, far_y - dy)
                                               ? part_above(patch, level, far_x, far_y, -dx, -dy)
                                               : infinity);
  return out;
}

/// Follows the border of the region clockwise, from its uppermost pixel.
void FreeOutline::follow(const Patch& patch, double level) {
  const auto first = std::find(inside_.begin(), inside_.end(), 1) - inside_.begin();
  const int start_x = x0_ + static_cast<int>(first % width_);
  const int start_y = y0_ + static_cast<int>(first / width_);
  int x = start_x, y = start_y, direction = 0;
  do {
    crossings_.push_back(crossing(patch, level, x, y, direction));
    const auto [out_x, out_y] = border_steps[static_cast<std::size_t>(direction)];
    const auto [on_x, on_y] = border_steps[static_cast<std::size_t>((direction + 1) % 4)];
    if (!contains(patch, x + on_x, y + on_y)) {
      direction = (direction + 1) % 4;
    } else if (contains(patch, x + on_x + out_x, y + on_y + out_y)) {
      x += on_x + out_x;
      y += on_y + out_y;
      direction = (direction + 3) % 4;
    } else {
      x += on_x;
      y += on_y;
    }
  } while (x != start_x || y != start_y || direction != 0);
}

void FreeOutline::measure_area(const std::vector<Eigen::Vector2d>& outline) {
  const core::OutlineMoments moments = core::outline_moments(outline);
  area_px2_ = moments.area;
  if (!(area_px2_ > 0)) return;
  centroid_px_ = moments.centroid;
  second_moments_px2_ = moments.second;
  perimeter_px_ = reach_px_ = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    perimeter_px_ += (outline[(i + 1) % outline.size()] - outline[i]).norm();
    reach_px_ = std::max(reach_px_, (outline[i] - centroid_px_).norm());
  }
  constexpr double min_filled = 0.97;  // noise and pixels take about a fifth of a pixel
  constexpr double ragged_px = 0.2;
  is_convex_ = filled_share(outline, area_px2_) >
               min_filled - ragged_px * static_cast<double>(outline.size()) / area_px2_;
}

/// Distances from all crossings, those of holes included.
void FreeOutline::measure_depths(const Patch& patch, double level, double blur_px) {
  constexpr double reach_sigmas = 3.5;
  const int reach = static_cast<int>(std::ceil(reach_sigmas * blur_px)) + 1;
  const int right = x0_ + patch.width() - 1, bottom = y0_ + patch.height() - 1;
  depth_px_.assign(inside_.size(), std::numeric_limits<float>::infinity());
  for (int y = y0_; y <= bottom; ++y)
    for (int x = x0_; x <= right; ++x) {
      if (!inside_[at(x, y)]) continue;
      for (int direction = 0; direction < 4; ++direction) {
        const auto [dx, dy] = border_steps[static_cast<std::size_t>(direction)];
        if (!patch.contains(x + dx, y + dy) || inside_[at(x + dx, y + dy)]) continue;
        const Eigen::Vector2d edge =
            Eigen::Vector2d(x, y) +
            part_above(patch, level, x, y, dx, dy) * Eigen::Vector2d(dx, dy);
        for (int v = std::max(y0_, y - reach); v <= std::min(bottom, y + reach); ++v)
          for (int u = std::max(x0_, x - reach); u <= std::min(right, x + reach); ++u) {
            float& depth = depth_px_[at(u, v)];
            depth = std::min(depth, static_cast<float>((Eigen::Vector2d(u, v) - edge).norm()));
          }
      }
    }
  for (std::size_t i = 0; i < inside_.size(); ++i)
    if (!inside_[i]) depth_px_[i] = -depth_px_[i];
}

/// Fits a parabola to the crossings up to `reach_px` from crossing k, on both sides as far as they
/// are usable. False if they are too few.
bool FreeOutline::fit_parabola(std::size_t k, double reach_px, Crossing& out) const {
  const std::size_t n = crossings_.size();
  const Eigen::Vector2d middle = crossings_[k].px;
  std::vector<Eigen::Vector2d> points{Eigen::Vector2d::Zero()};
  std::array<Eigen::Vector2d, 2> ends{middle, middle};  // after, before
  const auto max_steps = std::min(n / 2, static_cast<std::size_t>(4 * reach_px) + 4);
  for (int side = 0; side < 2; ++side)
    for (std::size_t step = 1; step < max_steps; ++step) {
      const Crossing& c = crossings_[side == 0 ? (k + step) % n : (k + n - step) % n];
      const Eigen::Vector2d arm = c.px - middle;
      if (!c.usable || c.part != crossings_[k].part || arm.norm() > reach_px) break;
      points.push_back(arm);
      ends[static_cast<std::size_t>(side)] = c.px;
    }
  if (points.size() < min_points) return false;
  const Eigen::Vector2d along = (ends[0] - ends[1]).normalized();
  if (!along.allFinite()) return false;
  const Eigen::Vector2d across(along.y(), -along.x());  // outwards of a clockwise outline
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Eigen::Vector2d& p : points) {
    const double t = along.dot(p) / reach_px;
    const Eigen::Vector3d row(1, t, t * t);
    normal += row * row.transpose();
    right += across.dot(p) * row;
  }
  const Eigen::Vector3d fit = core::solve_ldlt(normal, right);
  const Eigen::Vector3d own = core::solve_ldlt(normal, Eigen::Vector3d(1, 0, 0));
  if (!fit.allFinite() || !own.allFinite()) return false;
  const double slope = fit[1] / reach_px;
  const double cosine = 1 / std::sqrt(1 + square(slope));
  out.normal = cosine * (across - slope * along);
  out.curvature = -2 * fit[2] / square(reach_px) * square(cosine) * cosine;
  out.off_px = fit[0] * cosine;
  out.leverage = own[0];
  return true;
}

/// True if the outline is steep to the row or column; else it is steep to the other one.
bool FreeOutline::Crossing::has_line() const {
  const double cosine = line.outward * normal[line.column ? 1 : 0];
  return cosine > 0 && cosine >= std::abs(normal[line.column ? 0 : 1]);
}

void FreeOutline::leave_out_corners(double blur_px) {
  const std::size_t n = crossings_.size();
  const double reach_px = std::max(min_reach_px, narrow_sigmas * blur_px);
  std::vector<std::size_t> corners;
  for (std::size_t k = 0; k < n; ++k) {
    Crossing fitted;
    if (crossings_[k].usable && fit_parabola(k, reach_px, fitted) &&
        std::abs(fitted.curvature) * blur_px > corner_curvature)
      corners.push_back(k);
  }
  for (const std::size_t corner : corners)
    for (const bool before : {false, true})
      for (std::size_t step = 0; step < n; ++step) {
        Crossing& c = crossings_[before ? (corner + n - step) % n : (corner + step) % n];
        if ((c.px - crossings_[corner].px).norm() > free_corner_sigmas * blur_px) break;
        c.usable = false;
      }
  int part = 0;
  for (Crossing& c : crossings_) {
    c.part = part;
    if (!c.usable) ++part;
  }
  // The outline is closed.
  for (auto c = crossings_.rbegin(); c != crossings_.rend() && c->usable && c->part == part; ++c)
    c->part = 0;
}

void FreeOutline::fit_parabolas(double blur_px) {
  const double reach_px = std::max(min_reach_px, wide_sigmas * blur_px);
  for (std::size_t k = 0; k < crossings_.size(); ++k) {
    Crossing& c = crossings_[k];
    c.normal.setZero();
    if (!c.usable || !fit_parabola(k, reach_px, c) || !c.has_line()) continue;
    const int u = c.line.column ? 0 : 1, v = 1 - u;
    const Eigen::Vector2d on_curve = c.px + c.off_px * c.normal;
    c.line.slope = -c.normal[u] / c.normal[v];
    c.line.bend = -c.line.outward * c.curvature * std::pow(1 + square(c.line.slope), 1.5);
    c.line.edge = on_curve[v] + c.line.slope * (c.line.index - on_curve[u]);
  }
}

std::vector<RimLine> FreeOutline::lines() const {
  std::vector<RimLine> out;
  for (const Crossing& c : crossings_)
    if (c.has_line()) out.push_back(c.line);
  return out;
}

void FreeOutline::replace(const std::vector<std::optional<RimPoint>>& points, double blur_px) {
  std::vector<Crossing> measured;
  std::vector<Eigen::Vector2d> outline;
  std::vector<std::size_t> place;  // of measured points in the outline
  std::vector<Eigen::Vector2d> moves;
  std::size_t k = 0;
  for (Crossing c : crossings_) {
    outline.push_back(c.px);
    if (!c.has_line()) continue;
    if (const std::optional<RimPoint>& point = points[k++]) {
      place.push_back(outline.size() - 1);
      moves.push_back(point->px - c.px);
      c.px = point->px;
      c.sigma_px = point->sigma_px;
      measured.push_back(c);
    }
  }
  crossings_ = std::move(measured);
  fit_parabolas(blur_px);
  if (place.empty()) return;
  // The others, as near corners, move with the nearest measured point. The first outline is that at
  // one level, which is farther outside where the lamp is brighter.
  const std::size_t count = outline.size();
  for (std::size_t i = 0, next = 0; i < count; ++i) {
    if (next < place.size() && place[next] < i) ++next;
    const std::size_t after = next % place.size();
    const std::size_t before = (next + place.size() - 1) % place.size();
    const bool is_before = (i + count - place[before]) % count < (place[after] + count - i) % count;
    outline[i] += moves[is_before ? before : after];
  }
  measure_area(outline);
}

FreeOutline::Fitted FreeOutline::fitted() const {
  constexpr double min_free = 0.1;
  Fitted out;
  for (const Crossing& c : crossings_) {
    if (!c.has_line() || !(c.sigma_px > 0)) continue;
    out.points.push_back({c.px, c.normal, c.sigma_px});
    const double free = 1 - c.leverage;
    if (free < min_free) continue;
    out.chi2 += square(c.off_px / c.sigma_px);
    out.dof += free;
  }
  return out;
}

Eigen::Matrix2d FreeOutline::centroid_covariance_px2() const {
  constexpr double unmeasured_px = 0.15, correlated_px = 3;  // error of a part, its length
  constexpr double corners_px = 0.005;                       // blur rounds them unequally
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  double measured_px = 0;
  for (const Crossing& c : crossings_) {
    if (!c.has_line() || !(c.sigma_px > 0)) continue;
    const double length_px = 1 / std::abs(c.normal[c.line.column ? 1 : 0]);
    measured_px += length_px;
    const Eigen::Vector2d by_point = length_px / area_px2_ * (c.px - centroid_px_);
    sum += square(c.sigma_px) * by_point * by_point.transpose();
  }
  const double rest_px = std::max(0.0, perimeter_px_ - measured_px);
  const double by_rest = unmeasured_px * reach_px_ / area_px2_;
  sum.diagonal().array() += square(by_rest) * rest_px * correlated_px / 2 + square(corners_px);
  return sum;
}

}  // namespace occ::internal::detect
