// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/rim_tail.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr std::size_t arcs = 16;             // starts of the search, of half of the points each
constexpr std::size_t max_searched = 64;     // points of the search
constexpr std::size_t min_visible_rim = 16;  // points of the visible rim

/// Part of an outline that is that of an ellipse.
struct VisibleArc {
  EllipseFit fit;
  std::vector<RimPoint> points;
};

struct ArcLimits {
  double distance_px;  // max distance of a point from the ellipse
  double sigmas;       // the same, in its own sigmas
  double cosine;       // min cosine between the normals of the outline and of the ellipse

  double reach(const RimPoint& point) const {
    return std::max(distance_px, sigmas * point.sigma_px);
  }

  bool is_on(const FittedConic& conic, const RimPoint& point) const {
    return std::abs(conic.distance(point.px)) < reach(point) &&
           conic.outward(point.px).normalized().dot(point.normal) > cosine;
  }
};

/// Adds and removes points until the ellipse through them leaves them as they are, or a few times.
std::optional<VisibleArc> settle(const std::vector<RimPoint>& outline, EllipseFit fit,
                                 const ArcLimits& limits) {
  constexpr int max_passes = 6;
  VisibleArc arc;
  for (int pass = 0; pass < max_passes; ++pass) {
    const std::size_t before = arc.points.size();
    arc.points.clear();
    for (const RimPoint& point : outline)
      if (limits.is_on(fit.conic, point)) arc.points.push_back(point);
    if (2 * arc.points.size() < outline.size()) return std::nullopt;
    const std::optional<EllipseFit> again = fit_ellipse(arc.points, fit.conic);
    if (!again) return std::nullopt;
    fit = *again;
    if (arc.points.size() == before) break;
  }
  arc.fit = fit;
  return arc;
}

/// The ellipse through most points of an outline, at least half of them. `outline`: in their order.
std::optional<VisibleArc> find_arc(const std::vector<RimPoint>& outline, const ArcLimits& limits) {
  std::optional<VisibleArc> best;
  const std::size_t n = outline.size(), half = n / 2;
  for (std::size_t k = 0; k < arcs; ++k) {
    std::vector<RimPoint> part;
    for (std::size_t i = 0; i < half; ++i) part.push_back(outline[(k * n / arcs + i) % n]);
    const std::optional<EllipseFit> start = fit_ellipse(part);
    if (!start) continue;
    std::optional<VisibleArc> arc = settle(outline, *start, limits);
    if (arc && (!best || arc->points.size() > best->points.size())) best = std::move(arc);
  }
  return best;
}

/// A few points of the outline in the order of their directions from its middle.
std::vector<RimPoint> thin_out(std::vector<RimPoint> outline) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const RimPoint& point : outline) middle += point.px / static_cast<double>(outline.size());
  const auto direction = [&](const RimPoint& point) {
    return std::atan2(point.px.y() - middle.y(), point.px.x() - middle.x());
  };
  std::sort(outline.begin(), outline.end(),
            [&](const RimPoint& a, const RimPoint& b) { return direction(a) < direction(b); });
  const std::size_t n = outline.size();
  if (n <= max_searched) return outline;
  std::vector<RimPoint> few;
  for (std::size_t i = 0; i < max_searched; ++i) few.push_back(outline[i * n / max_searched]);
  return few;
}

/// True if the points are seen in all directions of the disc but for a gap of less than half.
bool surrounds(const VisibleArc& arc) {
  constexpr double max_mean = 0.65;  // 0 for a full circle, 0.64 for half of it
  const Eigen::Matrix2d to_circle = ellipse_from_circle(arc.fit.conic).inverse();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const RimPoint& point : arc.points)
    sum += (to_circle * (point.px - arc.fit.conic.centre)).normalized();
  return sum.norm() < max_mean * static_cast<double>(arc.points.size());
}

/// True if there are other points, and if they are clearly inside the ellipse: what is in front of
/// a lamp only hides. A rim that is no ellipse leaves its best ellipse on both sides and gradually.
bool only_hides(const std::vector<RimPoint>& outline, const VisibleArc& arc,
                const ArcLimits& limits) {
  constexpr double clearly = 4, max_near = 0.1;  // times the reach; share of the points
  std::size_t near = 0, inside = 0;
  for (const RimPoint& point : outline) {
    const double distance = arc.fit.conic.distance(point.px), reach = limits.reach(point);
    if (distance > reach) return false;
    if (distance > -reach) continue;
    ++(distance > -clearly * reach ? near : inside);
  }
  return inside > 0 && static_cast<double>(near) <= max_near * static_cast<double>(outline.size());
}

/// True if the patch is dark around the ellipse: no other light belongs to the blob.
bool is_alone(const Patch& patch, const Component& component, const FittedConic& conic,
              double level) {
  constexpr double far_px = 4, max_share = 0.02;
  double all = 0, outside = 0;
  for (int y = component.y0; y <= component.y1; ++y)
    for (int x = component.x0; x <= component.x1; ++x) {
      const double signal = *patch.at(x, y);
      if (signal < level) continue;
      all += signal;
      if (conic.distance(Eigen::Vector2d(x, y)) > far_px) outside += signal;
    }
  return outside <= max_share * all;
}

/// Derivative of the ellipse's centre by the errors of RimErrorCovariance.
Eigen::Matrix<double, 2, 5> centre_by_common_errors(const VisibleArc& arc) {
  std::vector<Eigen::Vector2d> growth, shift, stretch;
  for (const RimPoint& point : arc.points) {
    const Eigen::Vector2d& n = point.normal;
    growth.emplace_back(1, 0);
    shift.push_back(n);
    stretch.emplace_back(square(n.x()) - square(n.y()), 2 * n.x() * n.y());
  }
  Eigen::Matrix<double, 2, 5> by;
  by << centre_response(arc.points, arc.fit.conic, growth).col(0),
      centre_response(arc.points, arc.fit.conic, shift),
      centre_response(arc.points, arc.fit.conic, stretch);
  return by;
}

}  // namespace

std::optional<Rim> measure_rim_in_part(const Patch& patch, const Component& component,
                                       double blur_px, bool clipped) {
  if (component.touches_border) return std::nullopt;
  const double level = clipped ? rim_level * patch.full_scale_signal()
                               : 0.5 * weighted_mean_signal(patch, component);
  const std::vector<RimPoint> crossings = thin_out(scan_outline(patch, component, level));
  if (crossings.size() < min_visible_rim) return std::nullopt;
  // Crossings of whole pixels, of which a noisy gradient gives the normals.
  constexpr ArcLimits of_crossings{0.4, 0, 0.8}, of_points{0.15, 4, 0.95};
  const std::optional<VisibleArc> coarse = find_arc(crossings, of_crossings);
  if (!coarse || !surrounds(*coarse) || !is_alone(patch, component, coarse->fit.conic, level))
    return std::nullopt;

  std::optional<FreeRim> outline = clipped ? measure_saturated_free_rim(patch, component)
                                           : measure_free_rim(patch, component, blur_px);
  if (!outline) return std::nullopt;
  std::optional<VisibleArc> arc = find_arc(outline->points, of_points);
  if (!arc || arc->points.size() < min_visible_rim || !surrounds(*arc) ||
      !only_hides(outline->points, *arc, of_points))
    return std::nullopt;

  Rim rim;
  constexpr double clipped_growth_px = 1;  // of a clipped rim, not yet in its covariance
  rim.common_covariance_px2 = outline->common_covariance_px2;
  const Eigen::Matrix<double, 2, 5> by_common = centre_by_common_errors(*arc);
  rim.points = std::move(arc->points);
  rim.fit = arc->fit;
  align_normals(rim);
  inflate_sigmas(rim);
  RimErrorCovariance errors = rim.common_covariance_px2;
  if (clipped) errors(0, 0) += square(clipped_growth_px);
  rim.fit.centre_covariance_px2 += by_common * errors * by_common.transpose();
  rim.point_response = outline->point_response;
  rim.light_response_px2 = outline->light_response_px2;
  return rim;
}

}  // namespace occ::internal::detect
